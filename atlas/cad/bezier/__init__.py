"""Smooth bodies as Bezier faces for STEP."""
