"""All families of one patch by name."""

from touchatlas.sim.study.stability import noise_families, sampling_families, shape_families

FAMILIES = shape_families.FAMILIES | sampling_families.FAMILIES | noise_families.FAMILIES
