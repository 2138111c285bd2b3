"""Ranks that a scene or a simulation is asked to run over."""

import os

from . import checks

VARIABLE = "CAIRN_RANKS"  # by which `cairn run --ranks` tells the script


def asked(ranks):
    """Ranks for a simulation: the given ones, or those of `cairn run --ranks`; None for no ranks.

    Raises
    ------
    ValueError
        If it is neither a number, "mpi" nor a communicator of mpi4py.
    """
    if ranks is None:
        text = os.environ.get(VARIABLE, "")
        ranks = int(text) if text.isdecimal() else text or None
    if ranks is None or ranks == "mpi" or hasattr(ranks, "py2f"):
        return ranks
    if isinstance(ranks, str) or isinstance(ranks, bool):
        raise ValueError(f'ranks is {ranks!r}: give a number of ranks in this process, "mpi", or a communicator of mpi4py')
    return checks.count("ranks", ranks, 1, 100_000)
