"""A study on workers that fail: `study_on_workers.py [CELLS] [--workers N]`.

Starts a Dask scheduler and workers (two if not said) as processes of their own, and measures
CELLS (400) small cells there by the scheduler's address: fits of one patch. On the way one worker
is killed, and the client, too, which is then started again. Its table is that of one process, byte
for byte; the script fails where it is not. Then four cells more: one that takes 2 GB, one that
never ends, one whose process is killed by the system, and a good one, with limits of 0.5 GB and
8 s: each is a row. At last one without limits that takes 4 GB, where the process of each worker may
take 3 GB. Printed are the seconds of a cell that does nothing, the share of all
processor time that cells of the study get, and what went on.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil

from touchatlas.patch import fit_patch
from touchatlas.sim.study.cells import LEDGER, Cell
from touchatlas.sim.study.scenes import draw_scene
from touchatlas.sim.study.study import Study, run
from touchatlas.sim.study.workers import WorkOptions

COLUMNS = ("number", "surface", "k1", "k2", "words")
# Of each process that is started, bytes; and what two cells take.
MEMORY, GIGABYTES = 3_000_000_000, {"memory": 2, "more": 4}
# Where its tables go, and those from which a study that was cut short goes on.
FOLDER = Path("runs/study_on_workers")
SURFACES = ("ball", "ellipsoid", "torus")


def fitted(number: int, surface: str) -> list[dict[str, str]]:
    """Principal curvatures of a patch of a random scene."""
    scene = draw_scene(surface, 0.02, 0.0, np.random.default_rng([number]))
    found = fit_patch(scene.contact, scene.contours, scene.normal).patch.curvatures
    return [{"number": str(number), "surface": surface, "k1": repr(found.k1), "k2": repr(found.k2)}]


def difficult(number: int, kind: str) -> list[dict[str, str]]:
    """A cell that does not end well."""
    if kind in GIGABYTES:
        return [{"number": str(len(np.ones(GIGABYTES[kind] * 125_000_000)))}]
    if kind == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    while kind == "endless":
        pass
    return [{"number": str(number), "words": f"{kind}: well"}]


def nothing(number: int) -> list[dict[str, str]]:
    """A cell that takes no time."""
    return [{"number": str(number)}]


def study(measure) -> Study:
    return Study("table", COLUMNS, measure, "words")


def cells_of(count: int) -> list[Cell]:
    return [Cell("table.csv", {"number": str(n)}, (n, SURFACES[n % 3])) for n in range(count)]


def measured(measure, cells: list[Cell], folder: Path, work: WorkOptions) -> list[dict[str, str]]:
    folder.mkdir(exist_ok=True)
    return run(study(measure), cells, folder, lambda done, total: None, work)


def started(*words: str) -> subprocess.Popen:
    # Each in a group of its own, so that its children end with it.
    command = [sys.executable, "-m", *words]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen(command, start_new_session=True, **quiet)
    resource.prlimit(process.pid, resource.RLIMIT_AS, (MEMORY, MEMORY))
    return process


def ended(process: subprocess.Popen) -> None:
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def processor_seconds(processes) -> float:
    """Processor time of this process, and of others with their children."""
    every = [psutil.Process()]
    for process in processes:
        one = psutil.Process(process.pid)
        every += [one, *one.children(recursive=True)]
    return sum(sum(one.cpu_times()[:2]) for one in every)


def lines_in(path: Path) -> int:
    return path.read_bytes().count(b"\n") if path.exists() else 0


def client(folder: Path, count: int, address: str) -> subprocess.Popen:
    words = [str(count), "--client", str(folder), "--address", address]
    return subprocess.Popen([sys.executable, __file__, *words])


def wait_for(folder: Path, lines: int, process: subprocess.Popen) -> None:
    while lines_in(folder / LEDGER) < lines and process.poll() is None:
        time.sleep(0.05)


def killed_and_restarted(count: int, address: str, worker: subprocess.Popen, more) -> float:
    """Seconds of the study whose worker is killed after a quarter of the cells, and whose client
    after half of them."""
    folder, begun = Path("killed"), time.monotonic()
    process = client(folder, count, address)
    wait_for(folder, count // 4, process)
    ended(worker)
    print(f"worker killed after {lines_in(folder / LEDGER)} cells")
    more()
    wait_for(folder, count // 2, process)
    process.kill()
    process.wait()
    print(f"client killed after {lines_in(folder / LEDGER)} cells, and started again")
    code = client(folder, count, address).wait()
    assert code == 0, f"the client ended with {code}"
    return time.monotonic() - begun


def main(arguments: argparse.Namespace) -> int:
    count = arguments.cells
    address = arguments.address or f"tcp://127.0.0.1:{arguments.port}"
    on = WorkOptions(cluster=address)
    if arguments.client:
        measured(fitted, cells_of(count), Path(arguments.client), on)
        return 0
    FOLDER.mkdir(parents=True, exist_ok=True)
    os.chdir(FOLDER)
    begun, busy = time.monotonic(), processor_seconds([])
    measured(fitted, cells_of(count), Path("one"), WorkOptions(workers=0))
    own = (processor_seconds([]) - busy) / count
    print(f"{count} cells in one process: {time.monotonic() - begun:.1f} s")
    worker = ("distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard")
    running = [
        started(
            *("distributed.cli.dask_scheduler", "--port", str(arguments.port)),
            *("--host", "127.0.0.1", "--no-dashboard"),
        )
    ]
    try:
        running += [started(*worker) for _ in range(arguments.workers)]
        begun = time.monotonic()
        measured(nothing, [Cell("t.csv", {}, (0,))], Path("none"), on)
        print(f"scheduler, workers and first cell: {time.monotonic() - begun:.1f} s")
        begun, busy = time.monotonic(), processor_seconds(running)
        cells = [Cell("t.csv", {}, (n,)) for n in range(1, count + 1)]
        measured(nothing, cells, Path("none"), on)
        each = (time.monotonic() - begun) / count
        more = (processor_seconds(running) - busy) / count
        print(f"a cell that does nothing: {1e3 * each:.1f} ms, {1e3 * more:.1f} ms of processors")
        print(f"a cell of the study: {1e3 * own:.1f} ms, {own / (own + more):.2f} of all with it")
        seconds = killed_and_restarted(
            count, address, running[-1], lambda: running.append(started(*worker))
        )
        print(f"{count} cells on {arguments.workers} workers, with kills: {seconds:.1f} s")
        same = Path("one/table.csv").read_bytes() == Path("killed/table.csv").read_bytes()
        print(f"tables equal byte for byte: {same}")
        kinds = ("memory", "endless", "killed", "good")
        cells = [Cell("limits.csv", {"number": str(n)}, (n, kind)) for n, kind in enumerate(kinds)]
        limited = WorkOptions(cluster=address, cell_seconds=8.0, cell_gigabytes=0.5)
        rows = measured(difficult, cells, Path("limits"), limited)
        for kind, row in zip(kinds, rows, strict=True):
            print(f"{kind}: {row['words']}")
        [row] = measured(difficult, [Cell("limits.csv", {}, (0, "more"))], Path("limits"), on)
        print(f"more than a worker has: {row['words']}")
    finally:
        for process in running:
            if process.poll() is None:
                ended(process)
    return 0 if same else 1


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cells", nargs="?", type=int, default=400)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--port", type=int, default=8791)
    parser.add_argument("--client", help=argparse.SUPPRESS)
    parser.add_argument("--address", help=argparse.SUPPRESS)
    sys.exit(main(parser.parse_args()))
