"""A world to touch, and the judge."""
