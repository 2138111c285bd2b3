"""Settings of the OpenMP library, made before it is loaded with the kernels.

A thread that waits for another spins for a quarter of a millisecond, then sleeps. The library's own choice is to
spin for as long as the other takes, which on a busy machine, where the other may not be running at all, made two
threads 30 to 100 times slower than one.
"""

import os

if "OMP_WAIT_POLICY" not in os.environ:
    os.environ.setdefault("GOMP_SPINCOUNT", "20000")
