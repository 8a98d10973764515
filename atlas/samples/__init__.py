"""Samples: all that was measured, and the ends at which contact was lost."""
