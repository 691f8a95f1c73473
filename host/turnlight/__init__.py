"""Turnlight: a material scanner, from serial lines and pixels to SVBRDF maps."""

import os

# Nothing in this package calls out by itself; these libraries read their switch when imported.
os.environ.setdefault("DEPTHAI_TELEMETRY", "0")
os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
