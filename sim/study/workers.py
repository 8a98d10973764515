"""Workers: where the cells of a study are measured, on this machine or on a cluster, by Dask."""

import atexit
import logging
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass
from importlib import import_module
from importlib.util import find_spec
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING, Any, Protocol

from touchatlas.patch.words import count_of
from touchatlas.sim.run.interrupt import GRACE, held_interrupt, interrupt_of
from touchatlas.sim.study.about import versions
from touchatlas.sim.study.cell_process import answered, answered_apart
from touchatlas.sim.study.cells import LOST, Answer, Limits, check_limit

if TYPE_CHECKING:
    from distributed import Client

# Clusters by name: the package, its class, and the extra that brings it. Each reads its own part
# of Dask's configuration, ~/.config/dask/*.yaml.
CLUSTERS = {
    **{
        name: ("dask_jobqueue", kind)
        for name, kind in (
            ("slurm", "SLURMCluster"),
            ("pbs", "PBSCluster"),
            ("sge", "SGECluster"),
            ("lsf", "LSFCluster"),
            ("htcondor", "HTCondorCluster"),
        )
    },
    "k8s": ("dask_kubernetes.operator", "KubeCluster"),
}
# Longest time, s, in which a scheduler has to answer.
_ANSWERS = 20.0
_SETTINGS = {
    # Each task is a process's work of its own; profiles of threads that wait tell nothing.
    "distributed.worker.profile.enabled": False,
    # Fifty ticks a second in each process cost more than the cells' messages.
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.tick.limit": "60s",
    "distributed.admin.system-monitor.interval": "5s",
    # A machine with all cores at work answers late.
    "distributed.comm.timeouts.connect": "60s",
    "distributed.comm.timeouts.tcp": "120s",
    # Memory is that of the cells, which have limits of their own.
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": False,
}


@dataclass(frozen=True)
class WorkOptions:
    """Where the cells of a study are measured, and what one may take.

    Parameters
    ----------
    workers : int, optional
        How many cells are measured at once: as many as there are processors by default; 0 measures
        one after another in this process.
    cluster : str
        Address of a Dask scheduler (tcp://HOST:PORT), or slurm, pbs, sge, lsf, htcondor or k8s as
        Dask's own configuration files describe it. This machine by default.
    cell_seconds : float, s, optional
        Time after which a cell is ended; its row says so.
    cell_gigabytes : float, optional
        Memory after which a cell is ended; its row says so.
    wait : float, s
        How long a cluster may have no worker.
    """

    workers: int | None = None
    cluster: str = ""
    cell_seconds: float | None = None
    cell_gigabytes: float | None = None
    wait: float = 600.0

    def __post_init__(self) -> None:
        if self.workers is not None and self.workers < 0:
            raise ValueError(f"workers is {self.workers}; it must be a whole number >= 0")
        if not self.wait > 0.0:
            raise ValueError(f"wait is {self.wait}; it must be a number of seconds > 0")
        if self.cluster and self.cluster not in CLUSTERS and "://" not in self.cluster:
            raise ValueError(
                f"the cluster is {self.cluster!r}; give the address of a Dask scheduler, as "
                f"tcp://HOST:8786, or one of {', '.join(CLUSTERS)}"
            )
        for name in ("cell_seconds", "cell_gigabytes"):
            check_limit(name, getattr(self, name))
        limited = self.limits.seconds is not None or self.limits.gigabytes is not None
        if self.workers == 0 and (self.cluster or limited):
            raise ValueError(
                "workers is 0, which measures in this process; it goes with neither a cluster nor "
                "limits of a cell: give 1 or more"
            )

    @property
    def limits(self) -> Limits:
        """What one cell may take."""
        return Limits(self.cell_seconds, self.cell_gigabytes)


class Workers(Protocol):
    """What measures cells."""

    def answers(self, measure: Callable, given: dict[str, tuple]) -> Iterator[tuple[str, Answer]]:
        """Keys and answers of cells, in whatever order they come."""


class Here:
    """Measures one cell after another in this process."""

    def answers(self, measure: Callable, given: dict[str, tuple]) -> Iterator[tuple[str, Answer]]:
        for key, arguments in given.items():
            yield key, answered(measure, arguments)


@contextmanager
def workers(
    options: WorkOptions, cells: int, say: Callable[[str], None] = lambda words: None
) -> Iterator[Workers]:
    """Workers for so many cells. What stops the block ends those of this machine at once."""
    if options.workers == 0:
        yield Here()
        return
    import dask
    from distributed import Client

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with dask.config.set(_SETTINGS), ExitStack() as stack:
        with _whole_cluster():
            if "://" in options.cluster:
                client = _client_of(Client, options.cluster, min(_ANSWERS, options.wait))
                stack.callback(client.close)
            else:
                loop = _unreached_loop(stack)
                cluster = _own(options, cells, loop) if not options.cluster else _named(options)
                client = Client(cluster, set_as_default=False)
                stack.callback(_ended, client, cluster, not options.cluster)
        if find_spec("bokeh") and client.dashboard_link:
            say(f"the cells can be watched at {client.dashboard_link}")
        _check(client, options)
        yield OnDask(client, options)


@contextmanager
def _whole_cluster() -> Iterator[None]:
    """Hold Ctrl-C back until the cluster that the block makes is whole. One that is cut off in the
    making cannot be closed: Dask would try to at the end of the process, and fail aloud."""
    from distributed.deploy.spec import close_clusters

    try:
        with held_interrupt(grace=GRACE) as hold:
            yield
    except KeyboardInterrupt:
        # Its processes end with this one, whose pipes they read.
        atexit.unregister(close_clusters)
        raise
    if hold:
        raise interrupt_of(hold.signal)


def _unreached_loop(stack: ExitStack):
    """The loop of Dask, in a thread that Ctrl-C does not reach, nor any process that it begins: a
    terminal sends it to all, and this process ends the others."""
    from distributed.utils import LoopRunner

    runner = LoopRunner(asynchronous=False)
    # It unblocks signals of the thread that first begins a process.
    resource_tracker.ensure_running()
    # A thread has the mask of the one that begins it, and so has a process.
    masks = hasattr(signal, "pthread_sigmask")
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if masks else set()
    try:
        runner.start()
    finally:
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
    stack.callback(runner.stop)
    return runner.loop


def _own(options: WorkOptions, cells: int, loop):
    """A cluster on this machine, with no more workers than cells."""
    from distributed import LocalCluster

    count = min(options.workers or os.cpu_count() or 1, cells)
    try:
        return LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            dashboard_address=":0",
            memory_limit=0,
            silence_logs=logging.CRITICAL,
            loop=loop,
        )
    except RuntimeError as error:
        raise OSError(
            f"the workers do not start ({error}); try --workers 1, or 0 to measure in this process"
        ) from None


def _named(options: WorkOptions):
    """A cluster that Dask's configuration files describe."""
    package, kind = CLUSTERS[options.cluster]
    try:
        cluster = getattr(import_module(package), kind)()
    except ImportError:
        name = package.partition(".")[0].replace("_", "-")
        raise ValueError(
            f"--cluster {options.cluster} needs {name}; pip install {name}, or start a scheduler "
            "and workers by hand and give its address"
        ) from None
    cluster.scale(options.workers or 1)
    return cluster


def _client_of(client: type, address: str, seconds: float) -> "Client":
    """A client of a scheduler at an address. OSError where none answers in so many seconds."""
    try:
        return client(address, timeout=seconds, set_as_default=False)
    except (OSError, ValueError) as error:
        words = str(error).partition("\n")[0]
        raise OSError(
            f"no Dask scheduler answers at {address} ({words}); start one with dask scheduler, "
            f"and workers with dask worker {address} --nthreads 1"
        ) from None


def _check(client: "Client", options: WorkOptions) -> None:
    """Refuse a cluster without workers, or with another version of touchatlas."""
    try:
        client.wait_for_workers(1, timeout=options.wait)
    except TimeoutError:
        raise OSError(
            f"the cluster had no worker for {options.wait:g} s; start one, or wait longer with "
            "--wait"
        ) from None
    if not options.cluster:
        return
    ours = versions()
    try:
        theirs = client.run(versions)
    except Exception as error:
        raise OSError(
            f"touchatlas cannot be imported by all workers ({error}); install this version where "
            "they run"
        ) from None
    for worker, found in theirs.items():
        other = [f"{k} {found.get(k)} (here {v})" for k, v in ours.items() if found.get(k) != v]
        if other:
            raise OSError(
                f"{worker} has {', '.join(other)}, so that its rows would be others; install the "
                "same there"
            )


class OnDask:
    """Measures cells on the workers of a Dask client."""

    def __init__(self, client: "Client", options: WorkOptions) -> None:
        self._client, self._options = client, options

    def answers(self, measure: Callable, given: dict[str, tuple]) -> Iterator[tuple[str, Answer]]:
        """Keys and answers as they come. OSError where the scheduler is lost, which says nothing:
        all that it had is then called cancelled."""
        import cloudpickle
        from distributed import as_completed

        limits = self._options.limits
        futures = {}
        for key, arguments in given.items():
            work = cloudpickle.dumps((measure, arguments))
            # The same key for the same work: what a lost client left is not measured twice.
            name = f"cell-{key}-{'-'.join(map(str, asdict(limits).values()))}"
            future = self._client.submit(answered_apart, work, limits, key=name, pure=False)
            futures[future] = key
        left = len(futures)
        for future in as_completed(futures, loop=self._client.loop, raise_errors=False):
            key = futures.pop(future)
            if future.status == "finished":
                answer = future.result()
            elif future.status == "error":
                answer = _lost(future.exception(), limits)
            else:
                break
            left -= 1
            yield key, answer
            future.release()
        if left:
            raise OSError(
                f"the Dask scheduler was lost with {count_of(left, 'cell')} left; what is done is "
                "kept: call the same again"
            )


def _lost(error: Any, limits: Limits) -> Answer:
    """The answer for a cell whose workers died."""
    words = f"{type(error).__name__}: {error}".partition("\n")[0]
    if type(error).__name__ == "KilledWorker":
        words = "the workers that measured it died, as they do where memory is short"
    return Answer(LOST, words=words, limits=asdict(limits))


def _ended(client: "Client", cluster, own: bool) -> None:
    """Close a cluster; workers of this machine are not waited for, whose cells take minutes."""
    for nanny in cluster.workers.values() if own else ():
        nanny.auto_restart = False
        with suppress(Exception):
            os.kill(nanny.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
    for closes in (client, cluster):
        with suppress(Exception):
            closes.close(timeout=2)
