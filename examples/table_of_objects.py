"""Explore many objects and print one row each: what the exploration cost and how good it is.

python examples/table_of_objects.py OBJECT[:TOUCHES] ...

OBJECT is built in, or a mesh file; TOUCHES ends its exploration early.
"""

import sys
import tempfile
import time

import numpy as np

from touchatlas.sim import RunOptions, make_object, run_exploration
from touchatlas.sim.command.outcome import exit_code

HEAD = (
    "| object | coverage | mean/noise | mean/diagonal | p95/diagonal | watertight | chi (true) "
    "| faces | curvature/2pi | calibration | touches | length/sqrt(area) | seconds |"
)


def row(name: str, options: RunOptions) -> str:
    """Explore, judge, and format one line; seconds are of the whole run."""
    start = time.perf_counter()
    obj = make_object(name)
    with tempfile.TemporaryDirectory() as folder:
        n = run_exploration(obj, folder, options).numbers
    seconds = time.perf_counter() - start
    return (
        f"| {obj.name} | {n['coverage']:.4f} | {n['completeness_mean'] / n['noise_std']:.2f} "
        f"| {n['completeness_mean'] / n['diagonal']:.1e} "
        f"| {n['completeness_p95'] / n['diagonal']:.1e} | {'yes' if n['watertight'] else 'no'} "
        f"| {n['euler_characteristic']} ({n['true_euler_characteristic']}) "
        f"| {n['faces']} | {n['total_curvature_over_2pi']:.3f} "
        f"| {n['deviation_calibration']:.2f} | {n['touches']} "
        f"| {n['tracked_length'] / np.sqrt(obj.area):.0f} | {seconds:.1f} |"
    )


def main(*names: str) -> None:
    print(HEAD)
    print("|" + "---|" * (HEAD.count("|") - 1))
    for words in names or ("sphere",):
        name, _, most = words.partition(":")
        if most and not most.isdecimal():
            raise ValueError(f"got {words!r}; give OBJECT or OBJECT:TOUCHES, as sphere:20")
        print(row(name, RunOptions(max_touches=int(most) if most else None)), flush=True)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(*sys.argv[1:])))
