"""Triangles of the blended surface."""
