"""The planner that closes the frontier: plans beside edges, and the baseline of older figures."""
