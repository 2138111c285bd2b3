"""Pool of processes of one thread each; Ctrl-C ends them at once and keeps finished tasks."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import sys
import threading
from pathlib import Path

ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


class TaskError(RuntimeError):
    """A task could not be done: the scene or the solver refused it."""


def cores():
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _start():
    import cairn

    package = str(Path(cairn.__file__).absolute().parents[1])
    before = os.environ.get("PYTHONPATH")
    environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": package + (os.pathsep + before if before else "")}
    return subprocess.Popen(
        [sys.executable, "-m", "cairn.study.worker"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env=environment, start_new_session=True,  # Ctrl-C on the terminal reaches this process alone
    )


class Pool:
    """Some worker processes. `run(tasks, done)` calls done(task, row) in this thread as rows come in, in any order."""

    def __init__(self, workers=None):
        self.workers, self._processes = workers or cores(), []

    def __enter__(self):
        return self

    def __exit__(self, *exc):
        for process in self._processes:
            if process.poll() is None:
                process.kill()
            process.wait()
            with contextlib.suppress(BrokenPipeError):  # a task that the killed process had not read yet is lost with it
                process.stdin.close()
            process.stdout.close()
        self._processes = []

    def run(self, tasks, done, stop=lambda: False):
        """Runs all tasks, or until stop() is true: running tasks are then abandoned. Raises TaskError after the first failure."""
        waiting, rows = queue.SimpleQueue(), queue.SimpleQueue()
        for task in tasks:
            waiting.put(task)
        while len(self._processes) < min(self.workers, len(tasks)):
            self._processes.append(_start())
        for process in self._processes:
            threading.Thread(target=_serve, args=(process, waiting, rows), daemon=True).start()
        for _ in range(len(tasks)):
            task = row = None
            while row is None:
                if stop():
                    self.__exit__()
                    return False
                try:
                    task, row = rows.get(timeout=0.1)
                except queue.Empty:
                    continue
            if "failed" in row:
                self.__exit__()
                raise TaskError(f"{Path(task['target']['path']).name}, {task['kind']}: {row['failed']}")
            done(task, row["row"])
        return True


def _serve(process, waiting, rows):
    """Feeds one process with tasks until none waits."""
    while True:
        try:
            task = waiting.get_nowait()
        except queue.Empty:
            return
        try:
            process.stdin.write(json.dumps(task) + "\n")
            process.stdin.flush()
            line = process.stdout.readline()
        except (OSError, ValueError):
            line = ""
        rows.put((task, json.loads(line) if line else {"failed": f"its process ended with code {process.wait()}"}))
        if not line:
            return
