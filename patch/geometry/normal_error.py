"""Errors with a normal distribution."""

import numpy as np

# Standard deviations that hold 95 % of normal errors, no unit.
SURE = 1.96
# Largest standard deviation of the angle of a surface normal that is taken from samples, rad; a
# direction nearer to the tangent plane tells no side.
MOST_TILT = float(np.deg2rad(15.0))
