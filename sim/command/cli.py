"""touchatlas: the command line. Each command is imported when it is called."""

import sys
from collections.abc import Callable

from cyclopts import App

from touchatlas.sim.command.outcome import exit_code, named_by_flags
from touchatlas.sim.judge.number_meanings import NUMBERS, Meaning
from touchatlas.sim.recorded.fit_meanings import DIAGNOSIS_NUMBERS, FIT_NUMBERS

app = App(name="touchatlas", help="Learn the shape of an object by touch.", help_format="markdown")


def _explained(numbers: dict[str, Meaning], title: str) -> str:
    """What each number is, its unit and what is good, as a list in Markdown."""
    lines = [f"{title} (unit; good):", ""]
    for name, about in numbers.items():
        lines.append(f"- {name}: {about.what} ({about.unit}; {about.good})")
    return "\n".join(lines)


_EPILOGUES = {
    "evaluate": _explained(NUMBERS, "The numbers, lengths of built-in objects in mm"),
    "fit": _explained(FIT_NUMBERS, "The numbers of --json and patch.json")
    + "\n\n"
    + _explained(DIAGNOSIS_NUMBERS, "The numbers of its diagnosis"),
    "qualify": "P_Form.Sph.1x25 and P_Form.Sph.Scan are ranges of distances from the centre of the "
    "least-squares ball, as ISO 10360-5 has them. There one ball qualifies the tip and another "
    "tests it; here one does both. The 25 points are those nearest to the pattern, each within "
    "11.25 degrees; scan lines are as recorded. The form of the ball is in the figures.",
}
_FOLDER = "touchatlas.sim.command"
# Names that Python has for something else.
_MODULES = {"next": "next_"}
# Where cyclopts would call any number of arguments ARGS.
_USAGE = {
    "compare": "Usage: touchatlas compare [OPTIONS] RUN RUN ...",
    "learn": "Usage: touchatlas learn [OPTIONS] FILE ... | RUN FILE ...",
    "chart": "Usage: touchatlas chart [OPTIONS] [NAME ...]",
}
for _name, _help in (
    ("objects", "List the built-in objects."),
    ("explore", "Explore an object by simulated touch, build its atlas and judge it."),
    (
        "resume",
        "Go on with a stopped run, or with a finished one to more touches or a finer tolerance.",
    ),
    ("learn", "Learn curves, points and scans from files: an atlas, its surface, and doubts."),
    ("next", "Say where to touch now, for answers that touchatlas learn takes."),
    ("evaluate", "Compare a surface with the ground truth, both ways."),
    ("view", "Open the replay of a run in a browser."),
    ("compare", "Compare runs: a table of their numbers, and a chart."),
    ("fit", "Fit a patch to recorded contours: three or more curves through one point."),
    (
        "qualify",
        "Measure a probe on a ball of known radius: tip, stiffness, noise, errors of form.",
    ),
    ("export", "Write the atlas of a run as a STEP file for CAD, or the graph of its faces."),
    ("chart", "Chart accuracy against speed of one patch: our methods, the paper's, peers'."),
    ("regions", "Learn the many touches of a large part by regions, here or on a cluster."),
    ("study", "Explore many objects with many options and seeds, here or on a cluster."),
    ("paper", "Repeat the paper's tables and figures on simulated objects."),
):
    app.command(
        f"{_FOLDER}.{_MODULES.get(_name, _name)}:{_MODULES.get(_name, _name)}",
        name=_name,
        help=_help,
        help_epilogue=_EPILOGUES.get(_name),
        usage=_USAGE.get(_name),
    )


def run(imported: Callable[[], object] = lambda: None) -> int:
    """Carry out the command line; returns its exit code.

    Parameters
    ----------
    imported : called when all modules are imported, before the command begins
    """

    def command() -> int | None:
        # Help is printed, and its command does nothing.
        with named_by_flags(sys.argv[1:]):
            called, bound, _ = app.parse_args(exit_on_error=False, print_error=False)
            imported()
            return called(*bound.args, **bound.kwargs)

    return exit_code(command)
