"""Environments of Gymnasium: importing this registers them.

import gymnasium
import touchatlas.sim.benchmark

environment = gymnasium.make("touchatlas/Explore-v0")
"""

import gymnasium

NAME = "touchatlas/Explore-v0"

gymnasium.register(NAME, "touchatlas.sim.benchmark.environment:ExploreEnv")
