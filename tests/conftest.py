"""One thread of linear algebra in each process, set before numpy is imported, and what processes
share."""

import os

import pytest

from tests.kept import keep_in

# Two processes test at once. With two threads each on two cores, threads that wait for each other
# made a test of two seconds take two minutes.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")


@pytest.fixture(scope="session", autouse=True)
def _shared_folder(tmp_path_factory):
    """Explorations are kept beside the folders of the processes, or in that of the only one."""
    own = tmp_path_factory.getbasetemp()
    keep_in(own.parent if "PYTEST_XDIST_WORKER" in os.environ else own)
