"""The patches as one stack of arrays, the samples, and the normal equations of the fits."""
