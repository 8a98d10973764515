"""Learn where to touch from touches at random: `train.py [EPISODES] [--objects NAME ...]`.

Each step of `touchatlas/Explore-v0` chooses a candidate at random and keeps its features with the
reward. A ridge regression (scikit-learn) of the reward on features and their products gives the
weights, which are printed for `learned_planner.py`, with the share of the variance that they
explain on a fifth of the steps that were held back.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
from pathlib import Path

import gymnasium
import numpy as np

import touchatlas.sim.benchmark  # noqa: F401 - it registers the environment

sys.path.insert(0, str(Path(__file__).parent))

from learned_planner import products

OBJECTS = ("sphere", "ellipsoid", "torus", "bottle")


def steps(episodes: int, objects, most: int, seed: int):
    """Features (n, 4) of the candidates that were chosen, and their rewards (n,), in 1e-3 / s."""
    environment = gymnasium.make("touchatlas/Explore-v0", objects=objects, max_touches=most)
    rng, features, rewards = np.random.default_rng(seed), [], []
    for episode in range(episodes):
        observed, _ = environment.reset(seed=seed + episode)
        over = False
        while not over and observed["mask"].any():
            action = int(rng.integers(observed["mask"].sum()))
            features.append(observed["candidates"][action, 6:])
            observed, reward, terminated, truncated, _ = environment.step(action)
            rewards.append(1e3 * reward)
            over = terminated or truncated
        print(f"episode {episode}: {len(rewards)} steps", file=sys.stderr, flush=True)
    return np.array(features, float), np.array(rewards)


def main(arguments: argparse.Namespace) -> None:
    from sklearn.linear_model import Ridge

    features, rewards = steps(
        arguments.episodes, arguments.objects, arguments.touches, arguments.seed
    )
    last = np.arange(len(rewards)) >= 0.8 * len(rewards)
    model = Ridge(1.0, fit_intercept=False).fit(products(features[~last]), rewards[~last])
    explained = model.score(products(features[last]), rewards[last])
    print(f"{len(rewards)} steps, R2 of those held back {explained:.2f}")
    print("WEIGHTS =", [round(float(w), 3) for w in model.coef_])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("episodes", nargs="?", type=int, default=30)
    parser.add_argument("--objects", nargs="+", default=OBJECTS)
    parser.add_argument("--touches", type=int, default=25)
    parser.add_argument("--seed", type=int, default=100)
    main(parser.parse_args())
