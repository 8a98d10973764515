"""Contours, plane sections, curvatures, Darboux frames, local polynomials and patches."""
