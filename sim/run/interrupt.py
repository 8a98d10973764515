"""Ctrl-C, held back until it does no harm."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def held_interrupt() -> Iterator[Callable[[], bool]]:
    """Hold Ctrl-C back; what is yielded tells whether it came. A second one interrupts at once."""
    came: list[int] = []

    def note(number, _frame) -> None:
        if came:
            raise KeyboardInterrupt
        came.append(number)

    # Signals belong to the main thread, and one that is ignored (nohup) stays so.
    ours = threading.current_thread() is threading.main_thread()
    before = signal.getsignal(signal.SIGINT)
    if not ours or before in (signal.SIG_IGN, None):
        yield lambda: False
        return
    signal.signal(signal.SIGINT, note)
    try:
        yield lambda: bool(came)
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def late_interrupt() -> Iterator[None]:
    """Let Ctrl-C interrupt at the end of the block, not within; for imports of extension
    modules, some of which swallow it or break on it."""
    with held_interrupt() as interrupted:
        yield
    if interrupted():
        raise KeyboardInterrupt
