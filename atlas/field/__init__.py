"""Signed distance, normal and deviation of all faces together, and which face has a point."""
