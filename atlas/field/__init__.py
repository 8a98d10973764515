"""The blended surface at any point: distance, normal and deviation."""
