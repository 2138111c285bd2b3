"""Commands of the shell over ranks: mpirun with signals that are passed on, and what one process tells for all."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

from ..base import open_ranks
from ..base.given_ranks import VARIABLE

# Signals that mpirun passes on to the ranks, for those by which it would end them within a second, with their files open.
PASSED = {signal.SIGINT: signal.SIGUSR1, signal.SIGTERM: signal.SIGUSR2}
HANG_UP = getattr(signal, "SIGHUP", None)  # of a terminal that closes; goes on to processes of MPI as SIGTERM
NUMBERS = ("OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK", "SLURM_PROCID")  # variables of starters of MPI
LAUNCHED = "CAIRN_LAUNCHED"  # tells the processes that `cairn run --ranks` waits for them
MOST_PASSED = 2  # signals; a further one ends the ranks at once


def launch(count, arguments):
    """Runs a command of the shell over ranks of MPI, by mpirun; without it, or cairn_mpi, over ranks in one process.

    Parameters
    ----------
    count : int
        Number of ranks.
    arguments : list of str
        The arguments of `cairn`.

    Returns
    -------
    int
        Exit status: that of the ranks, or 128 and the number of the signal that stopped them.
    """
    program = [sys.executable, "-m", "cairn", *arguments]
    starter = shutil.which("mpirun") or shutil.which("mpiexec")
    if not (starter and Path(open_ranks.library()).exists()):
        missing = "mpirun" if not starter else "the library cairn_mpi"
        print(f"cairn: there is no {missing}: {count} ranks take turns in one process", file=sys.stderr)
        return _waited(program, {**os.environ, VARIABLE: str(count)}, {})
    open_mpi = "Open MPI" in subprocess.run([starter, "--version"], capture_output=True, text=True, check=False).stdout
    options = _of_open_mpi(count) if open_mpi else []
    environment = {**os.environ, VARIABLE: "mpi", LAUNCHED: "1"}
    return _waited([starter, "-n", str(count), *options, *program], environment, PASSED if open_mpi else {})


def _of_open_mpi(count):
    """Options of Open MPI: no messages of its own after an error, and more processes than there are cores."""
    return ["--quiet"] + ["--oversubscribe"] * (count > (os.cpu_count() or 1))


def _waited(words, environment, passed):
    """Exit status of a program to which SIGINT, SIGTERM and SIGHUP go on, as the signals that `passed` has for them.

    passed : {signal: signal} of mpirun, where SIGHUP goes on as SIGTERM; empty: all three go on as they are.
    """
    told = []

    def pass_on(number, _frame):
        told.append(number)
        more = len(told) > MOST_PASSED
        meant = signal.SIGTERM if number == HANG_UP and passed else number
        child.send_signal(signal.SIGTERM if more else passed.get(meant, meant))

    # A group of its own: what the terminal sends to that of this process reaches the program through this process alone.
    child = subprocess.Popen(words, env=environment, process_group=0, stdin=_input())
    heard = [*PASSED] + [HANG_UP] * (HANG_UP is not None and signal.getsignal(HANG_UP) != signal.SIG_IGN)  # as by nohup
    before = {number: signal.signal(number, pass_on) for number in heard}
    try:
        status = child.wait()
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
    if told and status:
        return 128 + told[0]
    status = 128 - status if status < 0 else status
    if status > 128 and status - 128 in set(signal.Signals) and status - 128 not in PASSED:
        print(f"cairn: error: a rank ended by {signal.Signals(status - 128).name}, and all with it", file=sys.stderr)
    return status


def _input():
    """Input of the program: a terminal would stop one that is in a group of its own and reads."""
    try:
        return subprocess.DEVNULL if sys.stdin is None or sys.stdin.isatty() else None
    except ValueError:  # closed
        return subprocess.DEVNULL


def take_signals():
    """Makes signals that the launching process passes on those that it received."""
    if LAUNCHED in os.environ:
        for number, by in PASSED.items():
            signal.signal(by, lambda *_, number=number: signal.raise_signal(number))


def first():
    """True if this process tells what is told once: rank 0, or a program without processes of MPI."""
    return number_of_process() == 0


def number_of_process():
    """Rank of this process, also before it has a simulation; 0 without processes of MPI."""
    if (number := open_ranks.number_of_process()) is not None:
        return number
    found = [os.environ[name] for name in NUMBERS if os.environ.get(name, "").isdecimal()]
    return int(found[0]) if found and os.environ.get(VARIABLE) == "mpi" else 0
