"""Simulated machines with ball tips: what a real probe reads before a body that only it knows."""
