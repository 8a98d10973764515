"""One run: its loop, its interruption, and how it ends."""
