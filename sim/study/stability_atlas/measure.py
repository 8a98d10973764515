"""The explorations of the families as rows of a sweep."""

import numpy as np

from touchatlas.sim.study.stability.sweep import COLUMNS, Job, Study
from touchatlas.sim.study.stability_atlas.families import ATLAS_FAMILIES
from touchatlas.sim.study.stability_atlas.outcome import AtlasVerdict, atlas_verdict


def measure_atlas(job: Job) -> list[dict[str, str]]:
    """The rows of one severity."""
    family, rows = ATLAS_FAMILIES[job.family], []
    place = family.severities.index(job.severity)
    for draw in range(job.draws):
        rng = np.random.default_rng([job.seed, *job.family.encode(), place, draw])
        rows.append(_row(job, draw, atlas_verdict(family.draw(job.severity, rng), rng)))
    return rows


def _row(job: Job, draw: int, found: AtlasVerdict) -> dict[str, str]:
    """The columns that an exploration has: no ratios, and its reach as ``claim``."""
    said = f"Euler {found.euler} of {found.true_euler}, {found.touches} touches, {found.words}"
    values = (
        *(job.family, repr(job.severity), str(draw), "atlas", found.outcome.value),
        *(f"{found.error:.4g}", "nan", "nan", "nan", f"{found.held:.4g}", f"{found.reached:.4g}"),
        *("; ".join(found.doubts), said),
    )
    return dict(zip(COLUMNS, values, strict=True))


MANY_PATCHES = Study(
    *("stability_atlas", ATLAS_FAMILIES, measure_atlas, 1, 2),
    *("largest error / tolerance, median", "surface within 3 tolerances, %"),
)
