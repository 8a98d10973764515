"""The atlas for CAD systems: lawful faces by their names in STEP, or patches as Bezier faces."""
