"""Pieces: one polynomial each, from plane to graded sextic, and the laws of planes to quadrics."""
