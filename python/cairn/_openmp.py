"""Settings of the OpenMP library, made before it is loaded with the kernels.

Waiting threads spin for a quarter of a millisecond, then sleep. By default the library spins without limit; on a busy
machine, where the awaited thread may not be running, this made two threads 30 to 100 times slower than a single thread.
"""

import os

if "OMP_WAIT_POLICY" not in os.environ:
    os.environ.setdefault("GOMP_SPINCOUNT", "20000")
