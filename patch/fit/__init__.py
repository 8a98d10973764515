"""The default estimator: from contours, or from samples, to the most probable patch."""
