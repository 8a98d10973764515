"""Read thousands of damaged and odd files: each must be read, or refused in one sentence.

    python examples/fuzz_files.py [COUNT] [SEED] [KIND ...]

COUNT inputs of each kind (csv, mesh, journal, atlas, toml) are made from good ones: bytes changed,
cut out, doubled or inserted, words replaced, and nonsense from scratch. Reading one may succeed, or
raise ValueError or OSError with one sentence. Anything else counts as a failure: another exception,
more than five seconds, more than 1 GiB of memory, or a file written beside the input. The input
that is being read is kept in fuzz/, so that one that ends the process can be found. Prints a line
for each kind; the exit code is 1 after a failure.
"""

import resource
import signal
import sys
import tempfile
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from good_files import MESHES, good_csv, good_mesh

from touchatlas.atlas import load_atlas
from touchatlas.sim import RunOptions, make_object, run_exploration
from touchatlas.sim.command.outcome import exit_code
from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.folder.option_tables import read_options
from touchatlas.sim.folder.run_folder import read_settings
from touchatlas.sim.judge.comparison import compare_runs
from touchatlas.sim.judge.surface_file import load_surface
from touchatlas.sim.recorded.fit_file import fit_file

MOST_SECONDS, MOST_BYTES = 5.0, 2**30
WORDS = (
    *(b"nan", b"inf", b"-inf", b"1e308", b"1e-308", b"0", b"-1", b"1e99999", b"", b",", b";"),
    *(b"\t", b"\n", b"\r", b'"', b"'", b"#", b"[", b"]", b"=", b"\0", b"\xff", b"\xef\xbb\xbf"),
    *(b"1,5", b"9999999999999999999", b"curve", b"x", b"ply", b"element", b"end_header", b"PK"),
    b"\xf0\x9f\x98\x80",
)


class TooSlowError(BaseException):
    """Reading took too long; no handler of the code under test catches it."""


def damaged(good: bytes, rng) -> bytes:
    """A good file with up to eight changes."""
    data = bytearray(good)
    for _ in range(rng.integers(1, 9)):
        place = int(rng.integers(0, len(data) + 1))
        length = int(rng.geometric(0.1))
        change = rng.integers(7)
        if change == 0:
            data[place : place + length] = rng.bytes(length)
        elif change == 1:
            del data[place : place + length]
        elif change == 2:
            data[place:place] = data[place : place + length]
        elif change == 3:
            data[place:place] = WORDS[rng.integers(len(WORDS))]
        elif change == 4:
            word = WORDS[rng.integers(len(WORDS))]
            data[place : place + len(word)] = word
        elif change == 5:
            lines = bytes(data).split(b"\n")
            rng.shuffle(lines[: len(lines) // 2])
            lines[rng.integers(len(lines))] = lines[rng.integers(len(lines))]
            data = bytearray(b"\n".join(lines))
        elif place < len(data):
            data[place] ^= 1 << rng.integers(8)
    if rng.random() < 0.05:
        del data[int(rng.integers(0, len(data) + 1)) :]
    if rng.random() < 0.02:
        data = bytearray(rng.bytes(int(rng.integers(0, 300))))
    return bytes(data)


class Fuzzer:
    """Good files, and how each kind is read."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        run = folder / "good"
        run_exploration(make_object("sphere"), run, RunOptions(max_touches=2, tolerance=0.5))
        self.files = {
            name: (run / name).read_bytes()
            for name in ("journal.sqlite", "atlas.npz", "run.toml", "evaluation.json", "steps.csv")
        }

    def make(self, kind: str, rng) -> bytes:
        """A damaged file."""
        names = {"journal": "journal.sqlite", "atlas": "atlas.npz", "toml": "run.toml"}
        if kind == "csv":
            return damaged(good_csv(rng), rng)
        if kind == "mesh":
            ending, _, data = good_mesh(rng).partition(b":")
            return ending + b":" + damaged(data, rng)
        return damaged(self.files[names[kind]], rng)

    def read(self, kind: str, data: bytes, work: Path) -> None:
        """Read a file as the commands do."""
        (work / "in").write_bytes(data)
        if kind == "csv":
            fit_file(work / "in")
        elif kind == "mesh":
            ending, _, data = data.partition(b":")
            path = work / f"in.{ending.decode()}"
            path.write_bytes(data)
            load_surface(path)
            make_object(str(path)).contact(
                np.array([0.0, 0.0, 9.0]), np.array([0.0, 0.0, -1.0]), 20.0
            )
        elif kind == "atlas":
            load_atlas(work / "in").blend(np.zeros((1, 3)))
        elif kind == "journal":
            journal = Journal(work / "in")
            try:
                journal.touches()
            finally:
                journal.close()
        else:
            self._read_settings(data, work)

    def _read_settings(self, data: bytes, work: Path) -> None:
        """A run whose run.toml is damaged: as options, as a run to compare, and to be resumed."""
        (work / "run.toml").write_bytes(data)
        for read in (
            lambda: read_options(work / "run.toml", RunOptions(), ("object", "versions")),
            lambda: read_settings(work),
            lambda: compare_runs([work, self.folder / "good"]),
        ):
            with suppress(ValueError, OSError):
                read()


@contextmanager
def limited_time():
    """Raise TooSlowError in a body that takes too long."""

    def too_slow(*_):
        raise TooSlowError

    before = signal.signal(signal.SIGALRM, too_slow)
    signal.setitimer(signal.ITIMER_REAL, MOST_SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def judge(fuzzer: Fuzzer, kind: str, data: bytes) -> str | None:
    """What is wrong with reading an input; None if nothing is."""
    with tempfile.TemporaryDirectory(dir=fuzzer.folder) as name:
        work, start = Path(name), time.perf_counter()
        try:
            with limited_time():
                fuzzer.read(kind, data, work)
        except (ValueError, OSError) as error:
            text = str(error)
            if "\n" in text or len(text) > 2000 or isinstance(error, UnicodeError):
                return f"no sentence: {text[:200]!r}"
        except TooSlowError:
            return f"more than {MOST_SECONDS:g} s"
        except BaseException as error:
            return f"{type(error).__name__}: {error}"
        allowed = {"in", "run.toml", *(f"in.{ending}" for ending in MESHES)}
        if others := {path.name for path in work.iterdir()} - allowed:
            return f"wrote {others}"
        if time.perf_counter() - start > MOST_SECONDS:
            return "too slow"
    return None


def _peak() -> int:
    """Most memory that this process has taken, bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def main(count: int, seed: int, kinds) -> int:
    wrong, failures = 0, Path("fuzz")
    if failures.exists() and not failures.is_dir():
        raise ValueError(f"{failures} is a file here, where inputs are kept; move it away")
    # What was done before in the same process is not counted.
    before = _peak()
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        fuzzer = Fuzzer(Path(name))
        for kind in kinds:
            rng = np.random.default_rng([seed, len(kind), ord(kind[0])])
            found, slowest, kept = 0, 0.0, failures / f"{kind}-now"
            failures.mkdir(exist_ok=True)
            for number in range(count):
                data = fuzzer.make(kind, rng)
                kept.write_bytes(data)
                start = time.perf_counter()
                if trouble := judge(fuzzer, kind, data):
                    found += 1
                    print(f"{kind} {number}: {trouble}", file=sys.stderr)
                    (failures / f"{kind}-{seed}-{number}").write_bytes(data)
                slowest = max(slowest, time.perf_counter() - start)
            kept.unlink()
            memory = _peak() - before
            if memory > MOST_BYTES:
                found += 1
            wrong += found
            print(
                f"{kind}: {count} inputs, {found} failures, slowest {slowest:.2f} s, memory "
                f"{memory / 2**20:.0f} MiB",
                flush=True,
            )
        with suppress(OSError):
            failures.rmdir()
    return 1 if wrong else 0


if __name__ == "__main__":
    words = sys.argv[1:]
    numbers = [*words[:2], *("1000", "0")[len(words[:2]) :]]
    kinds = words[2:] or ("csv", "mesh", "journal", "atlas", "toml")
    sys.exit(exit_code(lambda: main(*map(int, numbers), kinds)))
