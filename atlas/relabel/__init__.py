"""Changes of labels that shorten the description: cover, merge, split, unite, absorb."""
