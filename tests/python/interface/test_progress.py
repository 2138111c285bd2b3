"""The bar is cheap and silent where it should be; signals stop a loop between steps."""

import contextlib
import io
import os
import re
import signal
import sys
import threading
import time
from types import SimpleNamespace

import pytest
from cairn.run import loop
from cairn.run.progress import Progress, StopAtSignal


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_silent_when_not_on_a_terminal():
    stream = io.StringIO()
    with Progress(10, stream=stream) as bar:
        for _ in range(10):
            bar.update(contacts=1, iterations=2, residual=3.0)
    assert stream.getvalue() == "" and bar.steps == 10
    stream.close()
    with Progress(10, stream=stream) as bar:
        bar.update()
    stream = Terminal()
    with Progress(10, enabled=False, stream=stream) as bar:
        bar.update()
    assert stream.getvalue() == ""


def test_tells_what_matters_on_a_terminal():
    stream = Terminal()
    with Progress(3, stream=stream) as bar:
        for k in range(3):
            bar.update(contacts=12345, iterations=20 + k, residual=1.25e-7)
    text = stream.getvalue()
    for words in ("3/3", "12,345 contacts", "22 iterations", "residual 1.2e-07"):
        assert words in text


def test_without_rich(monkeypatch):
    def none(self):
        raise ImportError("rich")

    monkeypatch.setattr(Progress, "_rich_bar", none)
    stream = Terminal()
    with Progress(None, stream=stream) as bar:
        bar.update(contacts=5)
    assert "step 1  5 contacts" in stream.getvalue()


@pytest.mark.parametrize(("width", "absent"), [(50, ("contacts", "iterations")), (80, ("iterations",)), (120, ())])
def test_a_narrow_terminal_keeps_step_and_time_left(monkeypatch, width, absent):
    monkeypatch.setenv("COLUMNS", str(width))
    stream = Terminal()
    with Progress(200_000, stream=stream) as bar:
        bar.update(contacts=12345, iterations=20, residual=1.25e-7, steps=100_000)
        bar.update(contacts=12345, iterations=22, residual=1.25e-7, steps=100_000)
    lines = [s for s in re.split(r"[\r\n]", re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", stream.getvalue())) if s.strip()]
    assert "200000/200000" in lines[-1] and "left 0:00:00" in lines[-1] and "residual 1.2e-07" in lines[-1]
    assert all(len(line) < width for line in lines)
    for word in ("contacts", "iterations"):
        assert (word in lines[-1]) == (word not in absent)


def test_a_line_every_half_minute_where_there_is_no_terminal(monkeypatch):
    clock = [0.0]
    monkeypatch.setattr("cairn.run.progress.time.monotonic", lambda: clock[0])
    stream = io.StringIO()
    with Progress(1000, stream=stream) as bar:
        for _ in range(100):
            clock[0] += 1.0
            bar.update(contacts=12, iterations=3, residual=1e-5)
    assert stream.getvalue().splitlines() == [
        f"step {k}/1000 after 0:{k // 60:02d}:{k % 60:02d}  0:{(1000 - k) // 60:02d}:{(1000 - k) % 60:02d} left · "
        "12 contacts · 3 iterations · residual 1.0e-05"
        for k in (30, 60, 90)
    ]


def test_cheap():
    """A hundred thousand updates: few drawings, the rest a look at the clock."""
    stream = Terminal()
    with Progress(10**9, stream=stream) as bar:
        for _ in range(100_000):
            bar.update(contacts=1, iterations=1, residual=1.0)
    assert stream.getvalue().count("iterations") < 40


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_first_signal_asks_second_interrupts(number):
    before = [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)]
    with StopAtSignal() as stop:
        assert not stop
        os.kill(os.getpid(), number)
        assert stop and stop.signal == number
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), number)
            time.sleep(1)
    assert [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)] == before


@pytest.mark.parametrize("first", [signal.SIGHUP, signal.SIGTERM])
def test_further_hang_ups_do_not_interrupt(first):
    """The shell and the kernel may both tell that a terminal closed."""
    with StopAtSignal() as stop:
        for number in (first, signal.SIGHUP, signal.SIGHUP):
            os.kill(os.getpid(), number)
            time.sleep(0.01)
        assert stop.signal == first


@pytest.fixture
def closing():
    """A terminal, and a function that closes it, so that writes fail (EIO)."""
    master, slave = os.openpty()
    stream = os.fdopen(slave, "w")
    yield stream, lambda: os.close(master)
    with contextlib.suppress(OSError):
        stream.close()


@pytest.mark.parametrize("rich", [True, False])
@pytest.mark.parametrize("when", ["before", "within", "at the end"])
def test_a_terminal_that_closes_ends_the_bar_alone(closing, monkeypatch, rich, when):
    def none(self):
        raise ImportError("rich")

    stream, close = closing
    if not rich:
        monkeypatch.setattr(Progress, "_rich_bar", none)
    before = sys.stdout, sys.stderr
    if when == "before":
        bar = Progress(3, enabled="always", stream=stream)
        close()
    else:
        bar = Progress(3, stream=stream)
    with bar:
        for k in range(3):
            if k == 1 and when == "within":
                close()
            bar._due = 0.0  # it would draw at each update
            bar.update(contacts=12, iterations=20)
        if when == "at the end":
            close()
    assert bar.steps == 3 and (sys.stdout, sys.stderr) == before


def test_a_run_ends_well_whose_terminal_closed(closing, monkeypatch):
    stream, close = closing
    close()
    monkeypatch.setattr(sys, "stderr", stream)
    loop._tell(SimpleNamespace(steps=3, time=0.3), signal.SIGHUP, "run.vtkhdf")


def test_a_program_that_ignores_hang_ups_goes_on_ignoring_them():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with StopAtSignal() as stop:
            os.kill(os.getpid(), signal.SIGHUP)
            assert not stop
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_in_another_thread_it_does_nothing():
    seen = []

    def work():
        with StopAtSignal() as stop:
            seen.append(bool(stop))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [False]
