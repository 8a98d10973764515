"""Kill runs at random moments, resume them, and compare them with runs that were never stopped.

    python examples/kill_and_resume.py OUT [KILLS] [TERMS] [OBJECT ...]

Each run is started as a process of its own, and ended by `kill -9` (KILLS times in all) or SIGTERM
(TERMS times) at a random moment. It is resumed, and may be killed again while it is resumed. What
it ends with must be the atlas, the journal and the surface of the run that was never stopped, byte
for byte. Objects are built-in names or mesh files, each followed by :TOUCHES if it is to have a
budget. Prints a line for each object; the exit code is 1 if any byte differs.
"""

import os
import random
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

from touchatlas.sim.command.outcome import exit_code

FILES = ("journal.sqlite", "atlas.npz", "surface.ply", "run.toml")
COMMAND = [sys.executable, "-c", "from touchatlas.sim.command.entry import main; main()"]
# Chance that a resumed run is stopped again.
AGAIN = 0.3


def start(*words: str) -> subprocess.Popen:
    """A command in a process of its own, silent."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    return subprocess.Popen([*COMMAND, *words], **quiet, start_new_session=True)


def finish(process: subprocess.Popen) -> tuple[int, str]:
    """Exit code and standard error of a process."""
    _, errors = process.communicate(timeout=600)
    return process.returncode, errors.decode()


def stop(process: subprocess.Popen, number: int, after: float) -> bool:
    """Send a signal after some seconds; whether the process was still at work."""
    with suppress(subprocess.TimeoutExpired):
        process.wait(after)
        return False
    process.send_signal(number)
    return True


def whole_run(words: list[str], out: Path) -> tuple[dict[str, bytes], float, float]:
    """Files of a run that is never stopped; when it began to touch, and its seconds."""
    begun = time.perf_counter()
    process = start("explore", *words, "--out", str(out))
    while not (out / "journal.sqlite").exists() and process.poll() is None:
        time.sleep(0.01)
    first = time.perf_counter() - begun
    code, errors = finish(process)
    assert code == 0, errors
    return contents(out), first, time.perf_counter() - begun


def contents(out: Path) -> dict[str, bytes]:
    return {name: (out / name).read_bytes() for name in FILES}


def stopped_and_resumed(words, out: Path, number: int, span, rng) -> tuple[int, int]:
    """Stop a run at random moments and resume it to its end; counts stops and resumes."""
    stops = resumes = 0
    process = start("explore", *words, "--out", str(out))
    while True:
        if stops == 0 or rng.random() < AGAIN:
            stops += stop(process, number, rng.uniform(*span))
        code, errors = finish(process)
        assert "Traceback" not in errors, errors
        if code == 0:
            return stops, resumes
        assert code in (-number, 128 + number), (code, errors)
        # A process that was stopped before it began leaves nothing to go on with.
        again = ("resume", str(out)) if (out / "run.toml").exists() else ()
        resumes += bool(again)
        process = start(*(again or ("explore", *words, "--out", str(out))))


def main(out: Path, kills: int, terms: int, objects: list[str]) -> int:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise ValueError(f"{out} is a file, or in one; give a folder") from None
    rng, wrong = random.Random(0), 0
    for place, spec in enumerate(objects):
        name, _, touches = spec.partition(":")
        words = [name, *(("--max-touches", touches) if touches else ())]
        stem = Path(name).stem
        expected, first, seconds = whole_run(words, out / f"{stem}-whole")
        numbers = [signal.SIGKILL] * kills + [signal.SIGTERM] * terms
        stops = resumes = same = 0
        mine = numbers[place :: len(objects)]
        for count, number in enumerate(mine):
            folder = out / f"{stem}-{count}"
            # Most runs are stopped while they touch or conclude, some before.
            span = (0.5 * first, seconds)
            one, two = stopped_and_resumed(words, folder, number, span, rng)
            stops, resumes = stops + one, resumes + two
            same += contents(folder) == expected
            # Hours may pass: what is known so far is there if this script is stopped, too.
            print(f"{stem}: {same} of {count + 1} runs the same", file=sys.stderr, flush=True)
            for file in folder.iterdir():
                file.unlink()
        wrong += len(mine) - same
        print(
            f"{stem}: {len(mine)} runs of {seconds:.0f} s, {stops} times stopped, {resumes} times "
            f"resumed, {same} ended with the same bytes",
            flush=True,
        )
    return 1 if wrong else 0


if __name__ == "__main__":
    given = sys.argv[1:]
    folder, kills, terms = [*given[:3], *("runs/kills", "3", "1")[len(given[:3]) :]]
    objects = given[3:] or ["sphere:8"]
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    sys.exit(exit_code(lambda: main(Path(folder), int(kills), int(terms), objects)))
