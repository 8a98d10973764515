"""Ctrl-C and SIGTERM, held back until they do no harm."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.machinery import ExtensionFileLoader
from types import FrameType

# Seconds from a held interrupt to the end of what it lets finish. A second is left, of the five
# that are promised, for what cannot be cut short. Doubled, more results are written of long runs.
GRACE = 4.0
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
# Callbacks of weak references, each by its module. Python prints what is raised in them, and goes
# on.
_CALLBACKS = {
    ("weakref", "remove"),
    ("_weakrefset", "_remove"),
    ("matplotlib.transforms", "<lambda>"),
}


class Terminated(KeyboardInterrupt):
    """SIGTERM: it ends a program as Ctrl-C does."""


class Hold:
    """Whether an interrupt came while it was held back."""

    def __init__(self) -> None:
        self.signal: int | None = None

    def __bool__(self) -> bool:
        return self.signal is not None


@contextmanager
def held_interrupt(
    noticed: Callable[[], None] = lambda: None, grace: float | None = None
) -> Iterator[Hold]:
    """Hold Ctrl-C and SIGTERM back; what is yielded tells whether one came.

    A second one interrupts at once.

    Parameters
    ----------
    noticed : called when the first one comes
    grace : float, s, optional
        How long after the first one the block is interrupted, if it has not ended.
    """
    hold = Hold()
    # Signals belong to the main thread.
    if threading.current_thread() is not threading.main_thread():
        yield hold
        return

    def note(number, frame) -> None:
        if hold:
            raise_interrupt(number, frame)
            return
        hold.signal = number
        if grace is not None and hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, grace)
        noticed()

    def too_late(_number, frame) -> None:
        raise_interrupt(hold.signal, frame)

    # One that is ignored (nohup) stays so.
    before = {s: signal.getsignal(s) for s in _SIGNALS}
    ours: dict[signal.Signals, Callable] = {
        s: note for s, handler in before.items() if handler not in (signal.SIG_IGN, None)
    }
    if hasattr(signal, "SIGALRM"):
        before[signal.SIGALRM], ours[signal.SIGALRM] = signal.getsignal(signal.SIGALRM), too_late
    for number, handler in ours.items():
        signal.signal(number, handler)
    try:
        yield hold
    finally:
        if hold and hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number in ours:
            signal.signal(number, before[number])


def interrupt_of(number) -> KeyboardInterrupt:
    """The exception for a signal."""
    return Terminated() if number == signal.SIGTERM else KeyboardInterrupt()


def raise_interrupt(number, frame) -> None:
    """Raise the exception for a signal; where it would be lost, right after that.

    An extension module whose import is interrupted raises an ImportError instead. Python ignores
    what is raised where an object is deleted.
    """
    if not hasattr(signal, "setitimer") or not _is_lost(frame):
        raise interrupt_of(number)
    signal.signal(signal.SIGALRM, lambda _alarm, later: raise_interrupt(number, later))
    # An interrupt that would be lost is tried again.
    signal.setitimer(signal.ITIMER_REAL, 0.05)


def _is_lost(frame: FrameType | None) -> bool:
    """Whether a frame or one of its callers imports an extension module or deletes an object."""
    while frame is not None:
        code = frame.f_code
        name = frame.f_globals.get("__name__"), code.co_name
        if code.co_name == "__del__" or name in _CALLBACKS:
            return True
        if isinstance(frame.f_locals.get("self"), ExtensionFileLoader):
            return True
        frame = frame.f_back
    return False
