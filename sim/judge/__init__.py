"""Judging a surface by the truth: distances, numbers and what they mean, pictures."""
