"""Progress of a run on the terminal, and its end at a signal."""

import contextlib
import shutil
import signal
import sys
import threading
import time

_REFRESH_SECONDS = 0.1  # on a terminal
_LINE_SECONDS = 30.0  # where there is none
_BARS = (24, 10)  # lengths of the bar; the longest that fits is taken
UNWRITTEN = (OSError, ValueError, AttributeError)  # the terminal is gone (EIO), the stream closed, or there is none
SHOWN = ("contacts", "iterations", "residual", "overlap")  # figures of a step, in their order on the line


class Progress:
    """Progress of a run: a bar on a terminal, else a line every 30 s, as in the output file of a batch job.

    total : steps to come, or None if unknown. unit : name of a step.
    enabled : False to be silent; "always" to draw although the output is no terminal.
    A bar shows steps and the time left; if there is room also residual, overlap, contacts, iterations, the bar itself and the
    time elapsed. It is drawn at most ten times a second; other updates only read the clock.

    >>> with Progress(2, enabled=False) as bar:
    ...     for _ in range(2):
    ...         bar.update(contacts=12, iterations=30, residual=1e-6)
    """

    def __init__(self, total=None, enabled=True, stream=None, unit="step"):
        self._unit = unit
        self.total, self.steps, self._bar, self._task = total, 0, None, None
        self._stream = sys.stderr if stream is None else stream
        self._enabled = bool(enabled)
        self._drawn = self._enabled and (enabled == "always" or self._on_terminal())
        self._start = time.monotonic()
        self._due = self._start + (0.0 if self._drawn else _LINE_SECONDS)

    def _on_terminal(self):
        try:
            return self._stream.isatty()
        except (AttributeError, ValueError):  # no stream at all, or a closed one
            return False

    def __enter__(self):
        self._start = time.monotonic()
        self._due = self._start + (0.0 if self._drawn else _LINE_SECONDS)
        if self._drawn:
            try:
                self._bar = self._rich_bar()
            except ImportError:  # rich is a convenience
                self._bar = None
            if self._bar is not None:
                try:
                    self._bar.start()
                    self._task = self._bar.add_task(self._unit, total=self.total, figures="")
                except UNWRITTEN:
                    self._fall_silent()
        return self

    def _rich_bar(self):
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

        self._columns = {
            "unit": TextColumn(self._unit),
            "steps": MofNCompleteColumn(),
            **{f"bar {n}": BarColumn(bar_width=n) for n in _BARS},
            "gone": TimeElapsedColumn(),
            "left": TextColumn("left"),
            "time left": TimeRemainingColumn(),
            "figures": TextColumn("{task.fields[figures]}"),
        }
        console = Console(file=self._stream, force_terminal=True)
        return Progress(*self._columns.values(), console=console, auto_refresh=False)

    def update(self, contacts=None, iterations=None, residual=None, steps=1, overlap=None):
        """Counts `steps` more steps. overlap: the deepest so far over the size of the smaller body [-]."""
        self.steps += steps
        if self._enabled:
            now = time.monotonic()
            if now >= self._due or (self._drawn and self.steps == self.total):
                self._due = now + (_REFRESH_SECONDS if self._drawn else _LINE_SECONDS)
                try:
                    self._draw(_figures(contacts, iterations, residual, overlap), now - self._start)
                except UNWRITTEN:
                    self._fall_silent()

    def _draw(self, figures, gone):
        if self._bar is not None:
            names, text = self._chosen(figures, self._bar.console.width)
            self._bar.columns = tuple(self._columns[name] for name in names)
            self._bar.update(self._task, completed=self.steps, figures=text, refresh=True)
            return
        of = f"/{self.total}" if self.total else ""
        left = gone / self.steps * (self.total - self.steps) if self.total else None
        words = [] if left is None else [f"{_clock(left)} left"]
        text = " · ".join([*words, *(figures[name] for name in SHOWN if name in figures)])
        if self._drawn:
            room = shutil.get_terminal_size().columns - 1
            self._stream.write("\r" + f"{self._unit} {self.steps}{of}  {text}"[:room] + "\x1b[K")
        else:
            self._stream.write(f"{self._unit} {self.steps}{of} after {_clock(gone)}  {text}\n")
        self._stream.flush()

    def _fall_silent(self):
        """Ends the drawing where nothing can be written any more; the run goes on."""
        self._enabled = self._drawn = False
        self._stop_bar()

    def _stop_bar(self):
        bar, self._bar = self._bar, None
        if bar is not None:
            with contextlib.suppress(*UNWRITTEN):
                bar.stop()  # it gives the standard streams back, too

    def _chosen(self, figures, width):
        """(names of the columns that fit into a width, in their order on the line; text of the figures)."""
        count = len(str(self.steps if self.total is None else self.total))
        room = width - 1 - len(self._unit) - 1 - (2 * count + 1) - 1 - len("left -:--:--")
        shown, parts = {"unit", "steps", "left", "time left"}, []
        for name in ("residual", "overlap", "contacts", "iterations"):
            need = len(figures.get(name, "")) + (3 if parts else 1)
            if name in figures and need <= room:
                parts, room, shown = [*parts, name], room - need, shown | {"figures"}
        for name, need in (*((f"bar {n}", n + 1) for n in _BARS), ("gone", len("-:--:--") + 1)):
            if need <= room and not (name.startswith("bar") and any(n.startswith("bar") for n in shown)):
                room, shown = room - need, shown | {name}
        text = " · ".join(figures[name] for name in SHOWN if name in parts)
        return [name for name in self._columns if name in shown], text

    def __exit__(self, *exc):
        if self._bar is None and self._drawn and self.steps:
            with contextlib.suppress(*UNWRITTEN):
                self._stream.write("\n")
        self._stop_bar()


def _figures(contacts, iterations, residual, overlap):
    """{name: text} of the figures of the last step."""
    out = {}
    if contacts is not None:
        out["contacts"] = f"{int(contacts):,} contacts"
    if iterations is not None:
        out["iterations"] = f"{int(iterations)} iterations"
    if residual is not None:
        out["residual"] = f"residual {float(residual):.1e}"
    if overlap is not None:
        out["overlap"] = f"overlap {100 * float(overlap):.2g} %"
    return out


def _clock(seconds):
    """Text "h:mm:ss" of a time in seconds."""
    minutes, seconds = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{seconds:02d}"


# Signals that end a run after the step at hand: of Ctrl-C, of a queue, and of a terminal that closes.
STOPPING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class StopAtSignal:
    """Context in which the signals of STOPPING only request a stop, so that the current step is finished.

    It is true once a signal came. A second signal raises KeyboardInterrupt at once. Handlers are restored at the exit.
    Outside the main thread, where Python has no signals, it stays false.

    >>> with StopAtSignal() as stop:
    ...     while not stop:
    ...         break
    """

    def __init__(self, signals=STOPPING):
        self._signals, self._before, self.signal = signals, {}, None

    def __bool__(self):
        return self.signal is not None

    def __enter__(self):
        self.signal = None
        if threading.current_thread() is threading.main_thread():
            heard = [number for number in self._signals if signal.getsignal(number) != signal.SIG_IGN]  # nohup ignores SIGHUP
            self._before = {number: signal.signal(number, self._handle) for number in heard}
        return self

    def _handle(self, number, _frame):
        if self.signal is None:
            self.signal = number
        elif number != getattr(signal, "SIGHUP", None):  # the shell and the kernel may both tell that a terminal closed
            raise KeyboardInterrupt

    def __exit__(self, *exc):
        for number, handler in self._before.items():
            # None: the handler was not set by Python, and Python cannot name it
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        self._before = {}
