"""Where an atlas fails: families of bodies and of touches, each explored and judged."""
