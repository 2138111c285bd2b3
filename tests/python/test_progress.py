"""The bar is cheap and silent where it should be; signals stop a loop between steps."""

import io
import os
import signal
import threading
import time

import pytest
from cairn.progress import Progress, StopAtSignal


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


def test_cheap():
    """A hundred thousand updates within a second: ten drawings, the rest a look at the clock."""
    stream = Terminal()
    with Progress(10**9, stream=stream) as bar:
        start = time.perf_counter()
        for _ in range(100_000):
            bar.update(contacts=1, iterations=1, residual=1.0)
        assert time.perf_counter() - start < 2.0
    assert stream.getvalue().count("iterations") < 40


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_first_signal_asks_second_interrupts(number):
    before = [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)]
    with StopAtSignal() as stop:
        assert not stop
        os.kill(os.getpid(), number)
        assert stop and stop.signal == number
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), number)
            time.sleep(1)
    assert [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)] == before


def test_in_another_thread_it_does_nothing():
    seen = []

    def work():
        with StopAtSignal() as stop:
            seen.append(bool(stop))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [False]
