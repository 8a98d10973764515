"""Detail finer than a patch's polynomial, as a Gaussian process where the evidence is strong."""
