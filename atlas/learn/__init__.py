"""Learn: what a touch adds to an atlas."""
