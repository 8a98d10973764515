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
__getattr__ = lazy_names(
    {
        "EvaluateOptions": "touchatlas.sim.judge.truth",
        "Evaluation": "touchatlas.sim.judge.evaluate",
        "Journal": "touchatlas.sim.folder.journal",
        "Probe": "touchatlas.sim.world.probe",
        "Result": "touchatlas.sim.run.work",
        "Run": "touchatlas.sim.run.run",
        "ProbeOptions": "touchatlas.sim.machine.options",
        "RunOptions": "touchatlas.sim.folder.run_options",
        "Watcher": "touchatlas.sim.run.watcher",
        "Truth": "touchatlas.sim.judge.truth",
        "evaluate_surface": "touchatlas.sim.judge.evaluate",
        "explore": "touchatlas.sim.run.run",
        "load_run": "touchatlas.sim.run.run",
        "make_object": "touchatlas.sim.world.objects",
        "object_names": "touchatlas.sim.world.objects",
        "resume_exploration": "touchatlas.sim.run.exploration",
        "run_exploration": "touchatlas.sim.run.exploration",
        "truth_of": "touchatlas.sim.run.conclusion",
    }
)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
