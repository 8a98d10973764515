"""Runs to be looked at: the replay of one, and its curves."""
