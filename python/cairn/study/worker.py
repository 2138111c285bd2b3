"""A process of a study: reads a task a line, answers with a row a line, ends when nobody asks any more."""

import json
import os
import queue
import sys
import threading


def main():
    """Tasks as JSON on standard input, rows as JSON on standard output; output printed by scenes goes to standard error."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    lines = queue.SimpleQueue()

    def read():
        for line in sys.stdin:
            lines.put(line)
        os._exit(0)  # the study has ended or died, and so does this process

    threading.Thread(target=read, daemon=True).start()
    from cairn.study import tasks

    while True:
        task = json.loads(lines.get())
        try:
            answer = {"row": tasks.run(task)}
        except Exception as error:  # any error of a scene is reported, and the study goes on
            answer = {"failed": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main()
