"""Contours from a file, made ready for a fit, and the report of the fit."""
