"""Places: what is known where, and the rules by which the next one is chosen."""
