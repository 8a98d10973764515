"""Triangles of a body, mended where they are off, open or folded."""
