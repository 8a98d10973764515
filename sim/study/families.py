"""All families of one patch, by name."""

from touchatlas.sim.study.cases import Case
from touchatlas.sim.study.family import Family
from touchatlas.sim.study.hard_curves import CURVES
from touchatlas.sim.study.hard_records import RECORDS
from touchatlas.sim.study.hard_surfaces import SURFACES

FAMILIES: dict[str, Family[Case]] = SURFACES | CURVES | RECORDS
