"""Samples of contours, their graph, and the labels that tell which piece explains each."""
