"""LMGC90's text files: blocks that start with $, values cut by columns. Errors name file, line and column."""

from __future__ import annotations

import re
from pathlib import Path


class LegacyError(ValueError):
    """A legacy file that cannot be read or mapped; says file, line, what was found and the remedy."""


class Reader:
    """Lines of one file that carry something: comments (! in column 1) and blank lines are passed over."""

    def __init__(self, path):
        self.path = Path(path)
        try:
            raw = self.path.read_text(encoding="latin-1").splitlines()
        except OSError as error:
            raise LegacyError(f"{self.path}: cannot be read ({error.strerror}); give a folder that holds it") from error
        self.lines = [(n, line.rstrip()) for n, line in enumerate(raw, 1) if line.strip() and not line.startswith("!")]
        self.at = 0

    @property
    def line(self):
        """The line at hand, "" past the end."""
        return self.lines[self.at][1] if self.at < len(self.lines) else ""

    @property
    def ended(self):
        """Nothing is left."""
        return self.at >= len(self.lines)

    def next(self):
        """The line at hand, and go on."""
        if self.ended:
            raise LegacyError(f"{self.path}: ends in the middle of a block; is the file complete?")
        line = self.line
        self.at += 1
        return line

    def fail(self, text, back=1):
        """Refuses the line just read."""
        number = self.lines[min(max(self.at - back, 0), len(self.lines) - 1)][0] if self.lines else 0
        raise LegacyError(f"{self.path}, line {number}: {text}")

    def number(self, line, first, last):
        """The real number in columns first to last, from 1."""
        text = line[first - 1 : last].strip()
        try:
            return float(re.sub("[dD]", "e", text))
        except ValueError:
            self.fail(f"columns {first}-{last} hold {text!r}, not a number")

    def whole(self, line, first, last):
        """The whole number in columns first to last, from 1."""
        text = line[first - 1 : last].strip()
        if not re.fullmatch(r"[+-]?\d+", text):
            self.fail(f"columns {first}-{last} hold {text!r}, not a whole number")
        return int(text)

    def pairs(self, line, columns=(30, 51, 72)):
        """{label: value} of labels of 5 characters at the columns, each with its value in the 14 after it."""
        found = {}
        for c in columns:
            if line[c - 1 : c + 4].strip():
                found[line[c - 1 : c + 4].strip().rstrip("=").strip()] = self.number(line, c + 5, c + 18)
        return found

    def values(self, line, count, columns=(30, 51, 72)):
        """The first `count` numbers of the line, whatever their labels."""
        return [self.number(line, c + 5, c + 18) for c in columns[:count]]

    def header(self, line):
        """Type and number of a body line."""
        words = line.split()
        if len(words) < 2 or not words[1].isdigit():
            self.fail(f"{line.strip()!r} is no header of a body: type and number were expected")
        return words[0], int(words[1])


def real(value):
    """A number as LMGC90 reads it, 14 columns."""
    return f"{value:14.7E}"


def triple(labels, values):
    """A line of up to three labels and values, from column 30."""
    words = "".join(f"{label:<5}{real(v)}  " for label, v in zip(labels, values))
    return " " * 29 + words.rstrip()
