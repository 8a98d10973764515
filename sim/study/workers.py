"""Workers: where the cells of a study are measured, on this machine or on a cluster, by Dask."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Protocol

from touchatlas.patch.words import count_of
from touchatlas.sim.study.cell_process import answered, answered_apart
from touchatlas.sim.study.cells import LOST, Answer, Limits, check_limit
from touchatlas.sim.study.clusters import CLUSTERS, connected

if TYPE_CHECKING:
    from distributed import Client


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
    with connected(options, cells, say) as client:
        yield OnDask(client, options)


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
