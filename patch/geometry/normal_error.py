"""Errors with a normal distribution."""

# Standard deviations that hold 95 % of normal errors, no unit.
SURE = 1.96
