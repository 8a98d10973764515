"""One exploration of a simulated object: its loop, its folder, its judge."""
