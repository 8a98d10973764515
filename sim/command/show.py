"""What a command is doing: a bar on a terminal, plain lines elsewhere."""

import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from touchatlas.sim.command.outcome import say
from touchatlas.sim.look.words import Outlook
from touchatlas.sim.run.watcher import Watcher


class Shown(Watcher):
    """A watcher that remembers what is being done, with a note of how far it is."""

    def __init__(self) -> None:
        self.words, self._note, self._looked = "", "", 0.0
        self._tracked, self._outlook = 0.0, Outlook()
        self.is_viewed = False

    def begins(self, words: str) -> None:
        """A phase begins."""
        self.words, self._note = words, ""

    def assumes(self, words: str) -> None:
        """Something was assumed that the files of the run do not say."""
        say(words)

    def follows(self, frames, obj, tolerance) -> None:
        """The run begins: a browser shows it, where that is wanted."""
        if self.is_viewed:
            from touchatlas.sim.look.live import follow

            say(f"the run is shown at {follow(frames, obj, tolerance)} while it goes on")

    def touched(self, step, atlas) -> None:
        """A touch was learned."""
        self._tracked += step.touch.tracked_length
        known = step.plan.known
        before = {fault.name for fault in self._outlook.faults}
        self._outlook.add(step, atlas)
        for fault in self._outlook.faults:
            if fault.name not in before:
                say(fault.words)
        if time.monotonic() - self._looked > 0.5:
            self.note(self._outlook.note(step, self._tracked), known)
            self._looked = time.monotonic()

    def count(self, things: str):
        """A callback (done, total) that notes how many things are done, and when the rest will be,
        from those that were done since it was first called."""
        begun: list[tuple[float, int]] = []

        def count(done: int, total: int) -> None:
            if not begun:
                begun.append((time.monotonic(), done))
            words = f"{things} {done} of {total}"
            if begun[0][1] < done < total:
                passed = time.monotonic() - begun[0][0]
                words += f", {_time_left(passed / (done - begun[0][1]) * (total - done))}"
            self.note(words, done / max(total, 1))

        return count

    def note(self, text: str, fraction: float | None = None) -> None:
        """How far the phase is."""
        self._note = text

    def interrupted(self, words: str) -> None:
        """Ctrl-C or SIGTERM came."""
        # print could meet its own lock in a signal handler.
        with suppress(OSError):
            os.write(2, f"\ntouchatlas: {words}; Ctrl-C again ends at once\n".encode())


def _time_left(seconds: float) -> str:
    """When something will have ended.

    >>> _time_left(40.0), _time_left(700.0), _time_left(9000.0)
    ('40 s left', '12 min left', '2.5 h left')
    """
    if seconds < 100.0:
        return f"{seconds:.0f} s left"
    return (
        f"{seconds / 60.0:.0f} min left" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h left"
    )


class PlainLines(Shown):
    """A line for each phase of more than two seconds, and every ten seconds of it."""

    def __init__(self) -> None:
        super().__init__()
        self._since = time.monotonic()
        self._timer: threading.Timer | None = None

    def begins(self, words: str) -> None:
        """A phase begins."""
        self.end()
        super().begins(words)
        self._since = time.monotonic()
        self._wait(2.0)

    def end(self) -> None:
        """No more lines."""
        if self._timer is not None:
            self._timer.cancel()

    def _wait(self, seconds: float) -> None:
        self._timer = threading.Timer(seconds, self._say)
        self._timer.daemon = True
        self._timer.start()

    def _say(self) -> None:
        note = f", {self._note}" if self._note else ""
        line = f"touchatlas: {self.words}: {time.monotonic() - self._since:.0f} s{note}"
        with suppress(OSError, ValueError, AttributeError):
            # In one piece: another thread may write as well.
            sys.stderr.write(line + "\n")
            sys.stderr.flush()
        self._wait(10.0)


class Bar(Shown):
    """A bar for each phase."""

    def __init__(self, progress: Progress) -> None:
        super().__init__()
        self._progress = progress
        self._task: TaskID | None = None

    def begins(self, words: str) -> None:
        """A phase begins."""
        super().begins(words)
        if self._task is not None:
            self._progress.stop_task(self._task)
            self._progress.update(self._task, completed=1.0, total=1.0)
        self._task = self._progress.add_task(words, total=None, note="")

    def note(self, text: str, fraction: float | None = None) -> None:
        """How far the phase is."""
        super().note(text)
        if self._task is not None:
            total = None if fraction is None else 1.0
            self._progress.update(self._task, completed=fraction, total=total, note=text)


@contextmanager
def shown(words: str) -> Iterator[Shown]:
    """Show on standard error what goes on in the block, which begins with ``words``."""
    with _shown(words) as watcher:
        try:
            yield watcher
        except KeyboardInterrupt as stop:
            stop.add_note(f"this was left, and all that comes after it: {watcher.words}")
            raise


@contextmanager
def _shown(words: str) -> Iterator[Shown]:
    console = Console(stderr=True)
    if sys.stderr is not None and console.is_terminal:
        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(bar_width=12),
            TextColumn("{task.fields[note]}", markup=False),
            TimeElapsedColumn(),
        )
        with Progress(*columns, console=console) as progress:
            bar = Bar(progress)
            bar.begins(words)
            yield bar
        return
    lines = PlainLines()
    lines.begins(words)
    try:
        yield lines
    finally:
        lines.end()
