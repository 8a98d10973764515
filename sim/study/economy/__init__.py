"""What touches, lengths and time a tolerance takes: our planner, baselines, and peers."""
