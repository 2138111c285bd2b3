"""What every test leaves as it found it."""

import signal
import sys

import pytest


@pytest.fixture(autouse=True)
def broken_pipes_are_errors():
    """gmsh, which some tests begin themselves, lets a broken pipe end the program from then on."""
    yield
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)


@pytest.fixture(autouse=True)
def figures_are_closed():
    """Matplotlib warns of more than twenty, and warnings are errors: which test has the last depends on who runs before it."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
