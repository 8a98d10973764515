"""Drivers of real machines: controllers with a touch probe, their programs, logs and recordings."""
