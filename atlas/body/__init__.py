"""The body that the samples show: when faces are looked for, and what they make."""
