"""Lawful bodies as planes, spheres, cylinders and fillets for STEP."""
