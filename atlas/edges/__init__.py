"""Edges: where two labels meet, sharp, rounded or smooth, with their curves."""
