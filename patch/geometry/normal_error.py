"""Errors with a normal distribution."""

# Standard deviations that hold 95 % of normal errors, no unit. Doubled, every prediction is called
# good.
SURE = 1.96
