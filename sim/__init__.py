"""Simulated objects and probe, evaluation against the truth, studies, the command line."""

from typing import TYPE_CHECKING

from touchatlas.patch.lazy_names import lazy_names

if TYPE_CHECKING:
    from touchatlas.sim.folder.journal import Journal
    from touchatlas.sim.folder.run_options import RunOptions
    from touchatlas.sim.judge.evaluate import Evaluation, evaluate_surface
    from touchatlas.sim.judge.truth import EvaluateOptions, Truth
    from touchatlas.sim.machine.options import ProbeOptions
    from touchatlas.sim.run.conclusion import truth_of
    from touchatlas.sim.run.exploration import resume_exploration, run_exploration
    from touchatlas.sim.run.run import Run, explore, load_run
    from touchatlas.sim.run.watcher import Watcher
    from touchatlas.sim.run.work import Result
    from touchatlas.sim.world.objects import make_object, object_names
    from touchatlas.sim.world.probe import Probe

__all__ = [
    "EvaluateOptions",
    "Evaluation",
    "Journal",
    "Probe",
    "Result",
    "Run",
    "ProbeOptions",
    "RunOptions",
    "Truth",
    "Watcher",
    "evaluate_surface",
    "explore",
    "load_run",
    "make_object",
    "object_names",
    "resume_exploration",
    "run_exploration",
    "truth_of",
]
__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "folder.journal": "Journal",
        "folder.run_options": "RunOptions",
        "judge.evaluate": "Evaluation evaluate_surface",
        "judge.truth": "EvaluateOptions Truth",
        "machine.options": "ProbeOptions",
        "run.conclusion": "truth_of",
        "run.exploration": "resume_exploration run_exploration",
        "run.run": "Run explore load_run",
        "run.watcher": "Watcher",
        "run.work": "Result",
        "world.objects": "make_object object_names",
        "world.probe": "Probe",
    },
)
