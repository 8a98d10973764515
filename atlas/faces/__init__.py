"""Faces: what one law explains, or a free-form part, and the edges and corners between them."""
