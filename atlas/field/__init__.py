"""The blended surface as seen from any point: distance, normal, deviation."""
