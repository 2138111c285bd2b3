"""What every test leaves as it found it."""

import signal

import pytest


@pytest.fixture(autouse=True)
def broken_pipes_are_errors():
    """gmsh, which some tests begin themselves, lets a broken pipe end the program from then on."""
    yield
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)
