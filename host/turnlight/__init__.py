"""Turnlight: a material scanner, from serial lines and pixels to SVBRDF maps."""

import os

# Nothing in this package calls out by itself, whatever the environment says; these libraries read their
# switch when imported, and processes that are started from here inherit it.
os.environ["DEPTHAI_TELEMETRY"] = "0"
os.environ["ORT_DISABLE_TELEMETRY"] = "1"
