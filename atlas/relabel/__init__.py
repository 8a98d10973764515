"""Moves of labels that shorten the description: drop, join, split, grow, give to roundings."""
