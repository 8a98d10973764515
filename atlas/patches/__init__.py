"""The patches as one stack of arrays, the samples, and the equations that join them."""
