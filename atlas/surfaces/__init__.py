"""Surfaces of free-form faces: overlapping sextics with a common prior."""
