#!/usr/bin/env bash
# Where two meet: a numpy Generator, the noise of simulated touches, on workers of Dask.
#
# Common guess: tasks that draw from one scattered Generator draw one after another, as loops do, and
# the same seed gives the same noise on any number of workers.
# Versions: distributed 2026.8.0, numpy 2.4.6 (Linux, Python 3.11).
# Behaviour: each worker keeps a copy of the Generator, which its tasks advance. One worker gives four
# touches four draws; two workers give the same four touches two draws, each twice. So the noise of
# a touch depends on which worker took it, and touches share noise. A Generator that is submitted
# with each task is copied for each: all touches have one draw. Children of a SeedSequence, one a
# touch, give four draws wherever they run.
# Output seen:
#   one Generator, submitted with each touch: 1 of 4 draws differ
#   one Generator, scattered, on one worker: 4 of 4 draws differ
#   one Generator, scattered, on two workers: 2 of 4 draws differ
#   a child of a SeedSequence for each touch: 4 of 4 draws differ
# The script fails if that changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv v
v/bin/pip install --quiet distributed==2026.8.0 numpy==2.4.6
cat > meet.py <<'PY'
import numpy as np
from distributed import Client, LocalCluster


def noise(rng, touch):
    """What a simulated touch adds to a coordinate."""
    return float(rng.normal())


def draws(futures):
    return f"{len({future.result() for future in futures})} of {len(futures)} draws differ"


if __name__ == "__main__":
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster,
        Client(cluster) as client,
    ):
        rng = np.random.default_rng(0)
        futures = [client.submit(noise, rng, touch) for touch in range(4)]
        print("one Generator, submitted with each touch:", draws(futures))
        first, second = sorted(client.scheduler_info()["workers"])
        for name, places in (("one worker", [first] * 4), ("two workers", [first, second] * 2)):
            shared = client.scatter(np.random.default_rng(0), broadcast=True, hash=False)
            futures = [
                client.submit(noise, shared, touch, workers=[place], pure=False)
                for touch, place in enumerate(places)
            ]
            print(f"one Generator, scattered, on {name}:", draws(futures))
        children = np.random.SeedSequence(0).spawn(4)
        futures = [
            client.submit(noise, np.random.default_rng(child), touch)
            for touch, child in enumerate(children)
        ]
        print("a child of a SeedSequence for each touch:", draws(futures))
PY
v/bin/python meet.py 2> errors | tee seen
diff seen - <<'SEEN'
one Generator, submitted with each touch: 1 of 4 draws differ
one Generator, scattered, on one worker: 4 of 4 draws differ
one Generator, scattered, on two workers: 2 of 4 draws differ
a child of a SeedSequence for each touch: 4 of 4 draws differ
SEEN
