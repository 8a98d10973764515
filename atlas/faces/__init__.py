"""Faces: samples labelled by the laws that they obey, and the edges between them."""
