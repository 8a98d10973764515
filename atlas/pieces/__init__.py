"""Pieces: one polynomial each, on the ladder from plane to graded quartic, and its law."""
