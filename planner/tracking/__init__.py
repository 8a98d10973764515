"""Tracking: how a machine with a ball tip carries out a plan, and what its readings become."""
