"""Clusters of Dask: on this machine, as its configuration describes them, or at an address."""

import atexit
import logging
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from importlib import import_module
from importlib.util import find_spec
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING

from touchatlas.sim.run.interrupt import GRACE, held_interrupt, interrupt_of
from touchatlas.sim.study.about import versions

if TYPE_CHECKING:
    from distributed import Client

    from touchatlas.sim.study.workers import WorkOptions

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


@contextmanager
def connected(options: "WorkOptions", cells: int, say: Callable[[str], None]) -> Iterator["Client"]:
    """A client of a cluster with workers for so many cells. What stops the block ends those of this
    machine at once."""
    import dask
    from distributed import Client

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with dask.config.set(_SETTINGS), ExitStack() as stack:
        with _whole_cluster():
            if "://" in options.cluster:
                # A scheduler that is there answers in seconds, however long its workers take.
                client = _client_of(Client, options.cluster, min(20.0, options.wait))
                stack.callback(client.close)
            else:
                loop = _unreached_loop(stack)
                cluster = _own(options, cells, loop) if not options.cluster else _named(options)
                client = Client(cluster, set_as_default=False)
                stack.callback(_ended, client, cluster, not options.cluster)
        if find_spec("bokeh") and client.dashboard_link:
            say(f"the cells can be watched at {client.dashboard_link}")
        _check(client, options)
        yield client


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


def _own(options: "WorkOptions", cells: int, loop):
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


def _named(options: "WorkOptions"):
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


def _check(client: "Client", options: "WorkOptions") -> None:
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


def _ended(client: "Client", cluster, own: bool) -> None:
    """Close a cluster; workers of this machine are not waited for, whose cells take minutes."""
    for nanny in cluster.workers.values() if own else ():
        nanny.auto_restart = False
        with suppress(Exception):
            os.kill(nanny.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
    for closes in (client, cluster):
        with suppress(Exception):
            closes.close(timeout=2)
