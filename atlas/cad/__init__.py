"""The atlas for CAD systems: patches trimmed to their cells, as Bezier faces in a STEP file."""
