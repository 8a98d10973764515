"""A process that measures one cell after another and is ended where a cell exceeds its limits.

A worker of Dask cannot end what runs in its own thread, and much of what a cell calls holds
Python's interpreter lock, so that the worker would not answer its scheduler meanwhile.
"""

import os
import pickle
import queue
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, replace

from touchatlas.sim.study.cells import DONE, FAILED, LIMITED, LOST, Answer, Limits

THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_HERE = threading.local()
# What a process says when it has imported what a cell needs.
_BEGUN = "begun"


def answered(measure: Callable, given: tuple) -> Answer:
    """What becomes of a cell that is measured in this process."""
    begun = time.perf_counter()
    try:
        answer = Answer(DONE, measure(*given))
    except MemoryError as error:
        answer = Answer(LIMITED, words=f"it exceeded the memory there is: {error}")
    except Exception as error:
        answer = Answer(FAILED, words=f"{type(error).__name__}: {error}")
    return replace(answer, seconds=time.perf_counter() - begun, where=socket.gethostname())


def answered_apart(work: bytes, limits: Limits) -> Answer:
    """The same in a process of this thread's own, which it keeps for the next cell.

    Parameters
    ----------
    work : bytes
        The pickle of measure and given.
    limits : Limits
    """
    answer = Answer(LOST)
    for _ in range(limits.deaths):
        if getattr(_HERE, "process", None) is None:
            _HERE.process = CellProcess()
        answer = _HERE.process.answer(work, limits)
        if not _HERE.process.is_alive:
            _HERE.process = None
        if answer.kind != LOST:
            break
    return replace(answer, limits=asdict(limits))


class CellProcess:
    """The other process. It ends with this one, whose pipe it reads."""

    def __init__(self) -> None:
        import psutil

        # Read when numpy is loaded.
        alone = os.environ | dict.fromkeys(THREADS, "1")
        command, pipe = [sys.executable, "-m", __name__], subprocess.PIPE
        self._process = subprocess.Popen(command, env=alone, stdin=pipe, stdout=pipe)
        self._watched = psutil.Process(self._process.pid)
        self._answers: queue.Queue[Answer | str | None] = queue.Queue()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    @property
    def is_alive(self) -> bool:
        """Whether it takes another cell."""
        return self._process.poll() is None

    def _listen(self) -> None:
        """Take its answers; None is its end."""
        assert self._process.stdout is not None
        # What is cut off or no pickle raises whatever it likes, and whoever waits has to know.
        with self._process.stdout as file, suppress(Exception):
            while True:
                self._answers.put(pickle.load(file))
        self._answers.put(None)

    def answer(self, work: bytes, limits: Limits) -> Answer:
        """What becomes of a cell; where it exceeds a limit, or dies, the process is no more."""
        assert self._process.stdin is not None
        # What it takes to import what a cell needs is not the cell's.
        begun, most, limited = time.monotonic(), 0.0, Limits()
        try:
            pickle.dump(work, self._process.stdin)
            self._process.stdin.flush()
        except OSError:
            return self._dead(0.0, most)
        while True:
            try:
                # Memory is looked at as often: a second of allocation is about a gigabyte.
                found = self._answers.get(timeout=0.05)
            except queue.Empty:
                seconds, most = time.monotonic() - begun, max(most, self._gigabytes())
                words = _exceeded(seconds, most, limited)
                if words:
                    self.end()
                    return Answer(LIMITED, [], words, seconds, most, socket.gethostname())
                continue
            if found == _BEGUN:
                begun, limited = time.monotonic(), limits
                continue
            most = max(most, self._gigabytes())
            if found is None:
                return self._dead(time.monotonic() - begun, most)
            assert isinstance(found, Answer)
            return replace(found, gigabytes=most)

    def _gigabytes(self) -> float:
        import psutil

        try:
            return self._watched.memory_info().rss / 1e9
        except psutil.Error:
            return 0.0

    def _dead(self, seconds: float, most: float) -> Answer:
        """The answer where the process died by itself."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=5.0)
        self.end()
        code = self._process.returncode
        how = f"signal {-code} ({signal.strsignal(-code)})" if code < 0 else f"exit code {code}"
        words = f"its process ended with {how}, {most:.2g} GB in use"
        if code == -getattr(signal, "SIGKILL", 9):
            words += "; the system does that where memory is short"
        return Answer(LOST, [], words, seconds, most, socket.gethostname())

    def end(self) -> None:
        """End it, whatever it does."""
        self._process.kill()
        self._process.wait()
        self._listener.join()
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()


def _exceeded(seconds: float, gigabytes: float, limits: Limits) -> str:
    """Which limit a cell exceeds, in words; empty where none."""
    if limits.seconds is not None and seconds > limits.seconds:
        return f"it exceeded its time of {limits.seconds:g} s"
    if limits.gigabytes is not None and gigabytes > limits.gigabytes:
        return f"it exceeded its memory of {limits.gigabytes:g} GB"
    return ""


def _serve() -> None:
    """Measure what comes on standard input, and answer on what was standard output."""
    # A terminal sends Ctrl-C to all processes; the first one ends the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # What a cell prints must not come between the answers.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    waiting: queue.Queue[bytes] = queue.Queue()
    threading.Thread(target=_take, args=(waiting,), daemon=True).start()
    while True:
        try:
            cell = pickle.loads(waiting.get())
        except Exception as error:
            words = f"{type(error).__name__}: {error}; install on all workers what the study needs"
            pickle.dump(Answer(FAILED, words=words), answers)
        else:
            pickle.dump(_BEGUN, answers)
            answers.flush()
            pickle.dump(answered(*cell), answers)
        answers.flush()


def _take(waiting: queue.Queue) -> None:
    """Queue what comes; end the process where its owner is no more, whatever it is doing."""
    try:
        while True:
            waiting.put(pickle.load(sys.stdin.buffer))
    except (EOFError, OSError, pickle.UnpicklingError):
        os._exit(0)


if __name__ == "__main__":
    _serve()
