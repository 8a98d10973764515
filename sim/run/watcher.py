"""Watcher: what the caller of a run may hear of it while it goes on."""

from touchatlas.atlas import Atlas
from touchatlas.planner import Step
from touchatlas.sim.look.frames import Frames
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject


class Watcher:
    """Hears of a run and does nothing; a subclass shows it."""

    def begins(self, words: str) -> None:
        """A phase begins."""

    def assumes(self, words: str) -> None:
        """Something was assumed that the files of the run do not say."""

    def follows(self, frames: Frames, obj: ImplicitObject | MeshObject, tolerance: float) -> None:
        """The run begins: its frames grow with every touch."""

    def touched(self, step: Step, atlas: Atlas) -> None:
        """A touch was learned."""

    def interrupted(self, words: str) -> None:
        """Ctrl-C or SIGTERM came; the words say what is finished. This is called within a signal
        handler: it must take no lock."""
