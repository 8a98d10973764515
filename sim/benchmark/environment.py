"""ExploreEnv: where to touch next, as a task of Gymnasium."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from threadpoolctl import threadpool_limits

from touchatlas.atlas import Atlas
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.planner import PlannerOptions, Reason, Target
from touchatlas.sim.benchmark.choosing import Choosing
from touchatlas.sim.folder.run_options import RunOptions, fit_scale
from touchatlas.sim.machine.simulated_probe import probe_of
from touchatlas.sim.run.exploration import completed
from touchatlas.sim.study.course import MachineTime
from touchatlas.sim.study.oracle import errors
from touchatlas.sim.study.surface_peers import spread
from touchatlas.sim.world.objects import make_object

_FAR = 10.0


class ExploreEnv(gymnasium.Env):
    """A touch a step, until the surface is known to the tolerance or the budget is spent.

    Lengths in observations are over the object's diagonal, from the point of the first touch. An
    episode draws one of the objects, and fresh noise. Reset makes the first touch.

    Observation: ``samples`` (points and normals, spread evenly), ``candidates`` (places: point,
    normal, and ``Candidates.features``), ``mask`` (which of their lines are there), ``budget``
    (share of the touches that is left, share of the surface expected within the tolerance). What
    there is less of is zero.

    Action "candidate": the number of a candidate; larger ones than there are count around. Action
    "place": seven numbers from -1 to 1. They are the point, over 1.5 diagonals, its outward normal,
    and the heading of the first of three sampling planes, 60 degrees apart, over half a turn.

    Reward: share of the true surface that came within the tolerance, over the seconds that a
    machine takes for the touch. ``info`` has both, and whether the touch met anything.

    Parameters
    ----------
    objects : names or paths of meshes
    tolerance : float, diagonals
    max_touches : int
    action : "candidate" or "place"
    candidates, samples : int
        Lines of the observation.
    points : int
        True points by which the reward is measured.
    machine : MachineTime
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012

    def __init__(
        self,
        objects: Sequence[str] = ("sphere", "ellipsoid", "torus", "bottle", "mouse", "blob"),
        tolerance: float = 1e-2,
        max_touches: int = 40,
        action: str = "candidate",
        candidates: int = 32,
        samples: int = 256,
        points: int = 2000,
        machine: MachineTime = MachineTime(),
        render_mode: None = None,
    ) -> None:
        if action not in ("candidate", "place"):
            raise ValueError(f"action is {action!r}; it must be candidate or place")
        if not objects or isinstance(objects, str):
            raise ValueError(f"objects are {objects!r}; give a list of names or mesh files")
        self.objects, self._tolerance, self._most = tuple(objects), tolerance, max_touches
        self._candidates, self._samples, self._points = candidates, samples, points
        self._machine, self._by_place, self.render_mode = machine, action == "place", render_mode
        box: dict[str, Any] = {"low": -_FAR, "high": _FAR, "dtype": np.float32}
        self.observation_space = spaces.Dict(
            {
                "samples": spaces.Box(shape=(samples, 6), **box),
                "candidates": spaces.Box(shape=(candidates, 10), **box),
                "mask": spaces.MultiBinary(candidates),
                "budget": spaces.Box(0.0, 1.0, (2,), np.float32),
            }
        )
        if self._by_place:
            self.action_space: spaces.Space = spaces.Box(-1.0, 1.0, (7,), np.float32)
        else:
            self.action_space = spaces.Discrete(candidates)

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        """Draw an object, or take the one that ``options["object"]`` names, and touch it once."""
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(len(self.objects)))
        name = (options or {}).get("object", self.objects[drawn])
        own = int(self.np_random.integers(2**31))
        self._object = obj = make_object(name, own)
        run = RunOptions(tolerance=self._tolerance * obj.diagonal, seed=own)
        run = completed(run, obj)
        assert run.noise is not None and run.tolerance is not None
        start, outward = obj.start()
        self.atlas = Atlas(run.tolerance, run.atlas, fit_scale(run.noise, obj.diagonal))
        # Where a baseline chooses, a planner draws its places and nothing else.
        self.planner = Choosing(start, outward, PlannerOptions("farthest"))
        self._start, self._run = np.asarray(start, float), run
        probe_rng, truth_rng = np.random.default_rng(own).spawn(2)
        self._probe = probe_of(run, obj, probe_rng)
        self._truth = obj.sample(self._points, truth_rng)[0]
        self._touches, self._share, self.seconds = 0, 0.0, 0.0
        self._touch()
        return self._observed(), {"object": name, "share": self._share, "seconds": self.seconds}

    def step(self, action):
        """Touch once, and what has to be tried again there."""
        before, spent = self._share, self.seconds
        self.planner.chosen = self._target(action)
        met = self._touch()
        seconds = self.seconds - spent
        reward = (self._share - before) / seconds if seconds else 0.0
        info = {"share": self._share, "seconds": self.seconds, "met_surface": met}
        observed = self._observed()
        known = self.planner.is_known
        return observed, reward, known, not known and self._touches >= self._most, info

    def _target(self, action) -> Target | None:
        """What an action asks for."""
        if not self.action_space.contains(action):
            raise ValueError(f"the action is {action!r}; it must be one of {self.action_space}")
        if not self._by_place:
            there = len(self._found.targets)
            return self._found.targets[int(action) % there] if there else None
        point = self._start + 1.5 * self._object.diagonal * np.asarray(action[:3], float)
        size = float(np.linalg.norm(action[3:6]))
        normal = np.asarray(action[3:6], float) / size if size > 1e-6 else np.eye(3)[2]
        e1 = any_tangent(normal)
        turn = np.pi * float(action[6])
        heading = np.cos(turn) * e1 + np.sin(turn) * np.cross(normal, e1)
        return Target(point, normal, Reason.EXPAND, heading)

    def _touch(self) -> bool:
        """Touch until the choice is used; whether the surface was met."""
        met = False
        with threadpool_limits(1, "blas"):
            while self._touches < self._most:
                plan = self.planner.ask(self.atlas)
                if plan is None:
                    break
                touch = self._probe(plan)
                self.planner.tell(touch, self.atlas.add(touch))
                self.seconds += float(self._machine.seconds(touch, self._object.diagonal))
                self._touches += 1
                met |= bool(touch.contours)
                if self.atlas.body is not None and self.planner.chosen is None and met:
                    break
            self._found = self.planner.candidates(self.atlas, self._candidates)
            error = errors(self.atlas, self._truth)
        self._share = float(np.mean(error <= self.atlas.tolerance))
        return met

    def _observed(self) -> dict[str, np.ndarray]:
        pool, found = self.atlas.pool, self._found
        some = spread(pool.points, self._samples) if len(pool.points) else np.zeros(0, int)
        lines = np.hstack([self._local(found.points), found.normals, found.features])
        samples = np.hstack([self._local(pool.points[some]), pool.normals[some]])
        left = 1.0 - self._touches / self._most
        budget = np.array([left, min(self.planner.known, 1.0)], np.float32)
        return {
            "samples": _padded(samples, self._samples),
            "candidates": _padded(lines, self._candidates),
            "mask": (np.arange(self._candidates) < len(lines)).astype(np.int8),
            "budget": np.clip(budget, 0.0, 1.0),
        }

    def _local(self, points) -> np.ndarray:
        return (points - self._start) / self._object.diagonal


def _padded(lines, count: int) -> np.ndarray:
    """(count, c) the lines (n, c), then zeros."""
    out = np.zeros((count, lines.shape[1]), np.float32)
    out[: len(lines)] = np.clip(lines[:count], -_FAR, _FAR)
    return out
