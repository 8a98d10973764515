"""The default estimator: the most probable patch, given contours or samples."""
