"""Turnlight: a material scanner, from serial lines and pixels to SVBRDF maps."""
