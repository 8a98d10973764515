"""What to touch next: ask/tell."""
