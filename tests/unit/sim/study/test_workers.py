"""Cells on workers of Dask: limits, deaths, retries and refusals."""

import os
import signal
import sys
import time
from dataclasses import asdict, replace

import cloudpickle
import pytest

from touchatlas.sim.study.cell_process import CellProcess
from touchatlas.sim.study.cells import DONE, FAILED, LIMITED, LOST, Limits
from touchatlas.sim.study.workers import WorkOptions, workers


def end(kind: str) -> list:
    """A cell that ends as its name says."""
    if kind == "memory":
        return [len(b"x" * 10**9)]
    if kind == "raises":
        raise ArithmeticError("no number")
    if kind == "dies":
        os.kill(os.getpid(), signal.SIGKILL)
    if kind == "prints":
        print("this must not come between the answers", flush=True)
    while kind == "endless":
        pass
    return [{"kind": kind}]


def dies_once(path: str) -> list:
    if not os.path.exists(path):
        open(path, "w").close()
        os.kill(os.getpid(), signal.SIGKILL)
    return [{"kind": "again"}]


def work(kind: str) -> bytes:
    return by_value(end, kind)


def by_value(function, *given) -> bytes:
    """The tests are no package that another process could import."""
    cloudpickle.register_pickle_by_value(sys.modules[function.__module__])
    try:
        return cloudpickle.dumps((function, given))
    finally:
        cloudpickle.unregister_pickle_by_value(sys.modules[function.__module__])


def test_a_cell_that_exceeds_a_limit_ends_with_its_process_and_others_do_not():
    process, limits = CellProcess(), Limits(seconds=0.5, gigabytes=0.4)
    for kind, became in (("prints", DONE), ("raises", FAILED), ("good", DONE)):
        assert process.answer(work(kind), limits).kind == became and process.is_alive
    answer = process.answer(work("endless"), limits)
    assert answer.kind == LIMITED and answer.words == "it exceeded its time of 0.5 s"
    assert answer.seconds >= 0.5 and not process.is_alive
    answer = CellProcess().answer(work("memory"), Limits(gigabytes=0.4))
    assert answer.kind == LIMITED and answer.words == "it exceeded its memory of 0.4 GB"
    answer = CellProcess().answer(work("dies"), limits)
    assert answer.kind == LOST and "signal 9" in answer.words


def test_limits_settle_what_exceeded_them():
    process, limits = CellProcess(), Limits(seconds=0.1)
    answer = process.answer(work("endless"), limits)
    answer = replace(answer, limits=asdict(limits))
    assert answer.settles(limits) and not answer.settles(Limits(seconds=0.2))


@pytest.mark.slow
def test_a_dead_worker_costs_its_cell_which_is_measured_again(tmp_path):
    given = {"a": (str(tmp_path / "a"),), "b": (str(tmp_path / "b"),)}
    with workers(WorkOptions(workers=2), 2) as those:
        found = dict(those.answers(_module_free(dies_once), given))
    assert {answer.kind for answer in found.values()} == {DONE}


def _module_free(function):
    """The function as one of a script, which is pickled by value."""
    function.__module__ = "__main__"
    return function


@pytest.mark.slow
def test_what_stops_a_study_ends_its_workers():
    begun = time.monotonic()
    endless = _module_free(end)
    with pytest.raises(KeyboardInterrupt), workers(WorkOptions(workers=1, cell_seconds=60), 1) as w:
        next(w.answers(_module_free(lambda: [{}]), {"first": ()}))
        signal.signal(signal.SIGALRM, signal.default_int_handler)
        signal.setitimer(signal.ITIMER_REAL, 1.0)
        next(w.answers(endless, {"a": ("endless",)}))
    assert time.monotonic() - begun < 40.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"workers": -1}, "workers is -1; it must be a whole number >= 0"),
        ({"cluster": "slurmy"}, "the cluster is 'slurmy'; give the address"),
        ({"workers": 0, "cell_seconds": 1.0}, "it goes with neither a cluster nor limits"),
        ({"cell_seconds": -1.0}, "cell_seconds is -1.0; it must be a number > 0"),
    ],
)
def test_wrong_options_are_refused(options, words):
    with pytest.raises(ValueError, match=words):
        WorkOptions(**options)


@pytest.mark.slow
def test_a_scheduler_that_is_not_there_is_named():
    address = "tcp://127.0.0.1:9"
    words = "no Dask scheduler answers at tcp://127.0.0.1:9"
    with pytest.raises(OSError, match=words), workers(WorkOptions(cluster=address), 1):
        pass
