"""One thread of linear algebra in each process, set before numpy is imported."""

import os

# Two processes test at once. With two threads each on two cores, threads that wait for each other
# made a test of two seconds take two minutes.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
