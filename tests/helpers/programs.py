"""Programs in C and Fortran of the build of the tests, whose numbers are compared with Python's."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

BUILT = Path(os.environ["CAIRN_BUILD"]) / "programs" if "CAIRN_BUILD" in os.environ else None


def told_by(program, folder):
    """Numbers of a program by the first word of their lines."""
    if BUILT is None or not (BUILT / program).exists():
        pytest.skip(f"CAIRN_BUILD names no build with {program}: build the tests of C++")
    ended = subprocess.run([BUILT / program], cwd=folder, capture_output=True, text=True, timeout=120)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return {line.split()[0]: np.array(line.split()[1:], float) for line in ended.stdout.splitlines()}


def near(told, wanted, share=1e-12, scale=0.0):
    """Asserts equality within a share of the largest value, or of a scale."""
    wanted = np.ravel(wanted)
    assert told.shape == wanted.shape
    assert np.abs(told - wanted).max() <= share * max(scale, np.abs(wanted).max())
