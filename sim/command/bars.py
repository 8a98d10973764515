"""Progress bars of the commands."""

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn


def progress_bar(console: Console) -> Progress:
    """A progress bar with a note; it is shown on a terminal only."""
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.fields[note]}"),
        TimeElapsedColumn(),
    )
    return Progress(*columns, console=console, disable=not console.is_terminal)


def count_on(progress: Progress, name: str, things: str):
    """A callback (done, total) that shows on the bar how many things are done."""
    task = progress.add_task(name, total=None, note="")

    def watch(done: int, total: int) -> None:
        progress.update(task, completed=done, total=total, note=f"{done} of {total} {things}")

    return watch


def follow_on(progress: Progress, name: str):
    """A callback (step, atlas) that shows every fifth touch of a run on the bar."""
    task = progress.add_task(name, total=1.0, note="")
    tracked = 0.0

    def watch(step, atlas) -> None:
        nonlocal tracked
        tracked += step.touch.tracked_length
        if step.plan.number % 5 == 0:
            covered = atlas.predicted_coverage()
            note = (
                f"touch {step.plan.number + 1}  outlines closed {covered:.1%}  "
                f"deviation {atlas.predicted_deviation():.3g}  tracked {tracked:.4g}"
            )
            progress.update(task, completed=covered, note=note)

    return watch
