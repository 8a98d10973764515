"""Differential geometry on arrays: frames, plane sections, curvatures, polynomials, patches."""
