"""The entry point: it imports nothing heavy before Ctrl-C is taken care of.

Before that, while Python itself starts, Ctrl-C is Python's own: it prints a traceback. Nothing has
been read or written then.
"""

import os
import signal
import sys


def main() -> None:
    """Entry point."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def stop(number, _frame) -> None:
        # Some extension modules break on an exception while they are imported.
        try:
            os.write(2, b"touchatlas: stopped before anything was done\n")
        finally:
            os._exit(128 + number)

    # Signals belong to the main thread, and one that is ignored (nohup) stays so.
    ours = [number for number, handler in before.items() if handler not in (signal.SIG_IGN, None)]
    try:
        for number in ours:
            signal.signal(number, stop)
    except ValueError:
        ours = []
    try:
        from touchatlas.sim.command.cli import run

        code = run(lambda: _interruptible(ours))
    finally:
        for number in ours:
            signal.signal(number, before[number])
    sys.exit(code)


def _interruptible(numbers) -> None:
    """Let signals raise KeyboardInterrupt from now on."""
    from touchatlas.sim.run.interrupt import raise_interrupt

    for number in numbers:
        signal.signal(number, raise_interrupt)
