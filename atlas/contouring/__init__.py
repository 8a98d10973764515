"""Contouring: cubes of space that the surface of a body passes, and the triangles in them."""
