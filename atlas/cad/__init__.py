"""The atlas for CAD systems: lawful faces by their names in STEP, smooth bodies as Bezier faces."""
