"""The flags of a command that measures in several processes. Others need not import what these
take."""

from typing import Annotated

from cyclopts import Parameter

from touchatlas.sim.study.workers import WorkOptions

# Each of its fields is a flag.
Work = Annotated[WorkOptions, Parameter(name="*")]
