"""Triangles of the surface of a body."""
