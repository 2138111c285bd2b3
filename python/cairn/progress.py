"""How a run is going, on the terminal, and how it ends at a signal."""

import signal
import sys
import threading
import time

_REFRESH_SECONDS = 0.1


class Progress:
    """A bar on the terminal: steps, time left, contacts, iterations, residual. Silent when not on a terminal.

    total : steps to come, or None if nobody knows. unit : what is counted.
    enabled : False to be silent; "always" to draw although the output is no terminal.
    Drawn at most ten times a second; between, an update costs a look at the clock.

    >>> with Progress(2, enabled=False) as bar:
    ...     for _ in range(2):
    ...         bar.update(contacts=12, iterations=30, residual=1e-6)
    """

    def __init__(self, total=None, enabled=True, stream=None, unit="step"):
        self._unit = unit
        self.total, self.steps, self._bar, self._task, self._due = total, 0, None, None, 0.0
        self._stream = sys.stderr if stream is None else stream
        self._enabled = bool(enabled) and (enabled == "always" or self._on_terminal())

    def _on_terminal(self):
        try:
            return self._stream.isatty()
        except (AttributeError, ValueError):  # no stream at all, or a closed one
            return False

    def __enter__(self):
        if self._enabled:
            try:
                self._bar = self._rich_bar()
            except ImportError:  # rich is a convenience
                self._bar = None
            if self._bar is not None:
                self._bar.start()
                self._task = self._bar.add_task(self._unit, total=self.total, figures="")
        return self

    def _rich_bar(self):
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

        return Progress(
            TextColumn(self._unit),
            MofNCompleteColumn(),
            BarColumn(bar_width=24),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            TextColumn("{task.fields[figures]}"),
            console=Console(file=self._stream, force_terminal=True),
            auto_refresh=False,
        )

    def update(self, contacts=None, iterations=None, residual=None, steps=1):
        """One more step is done (or `steps` of them)."""
        self.steps += steps
        if self._enabled:
            now = time.monotonic()
            if now >= self._due or self.steps == self.total:
                self._due = now + _REFRESH_SECONDS
                self._draw(contacts, iterations, residual)

    def _draw(self, contacts, iterations, residual):
        figures = []
        if contacts is not None:
            figures.append(f"{int(contacts):,} contacts")
        if iterations is not None:
            figures.append(f"{int(iterations)} iterations")
        if residual is not None:
            figures.append(f"residual {float(residual):.1e}")
        text = " · ".join(figures)
        if self._bar is not None:
            self._bar.update(self._task, completed=self.steps, figures=text, refresh=True)
        else:
            of = f"/{self.total}" if self.total else ""
            self._stream.write(f"\r{self._unit} {self.steps}{of}  {text}\x1b[K")
            self._stream.flush()

    def __exit__(self, *exc):
        if self._bar is not None:
            self._bar.stop()
        elif self._enabled and self.steps:
            self._stream.write("\n")
        self._bar = None


class StopAtSignal:
    """While it is entered, Ctrl-C and SIGTERM ask for a stop instead of causing one: the step at hand is finished.

    It is true once a signal came. A second signal is a KeyboardInterrupt at once. Handlers are restored at the exit.
    Outside the main thread, where Python has no signals, it stays false.

    >>> with StopAtSignal() as stop:
    ...     while not stop:
    ...         break
    """

    def __init__(self, signals=(signal.SIGINT, signal.SIGTERM)):
        self._signals, self._before, self.signal = signals, {}, None

    def __bool__(self):
        return self.signal is not None

    def __enter__(self):
        self.signal = None
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._handle) for number in self._signals}
        return self

    def _handle(self, number, _frame):
        if self.signal is not None:
            raise KeyboardInterrupt
        self.signal = number

    def __exit__(self, *exc):
        for number, handler in self._before.items():
            # None: the handler was not set by Python, and Python cannot name it
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        self._before = {}
