"""Objects to touch, analytic or meshes, and the simulated probe that touches them."""
