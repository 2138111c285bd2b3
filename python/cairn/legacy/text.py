"""LMGC90's text files: blocks that start with $, values cut by columns. Errors name file, line and column."""

from __future__ import annotations

import math
import re
from pathlib import Path

from ..post.errors import ContentError

# A number of Fortran: its mantissa and its exponent, whose letter may be left out before a sign.
REAL = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[dDeEqQ]?([+-]\d+)|[dDeEqQ](\d+))?")


def fortran(found):
    """The value of a match of REAL."""
    return float(f"{found[1]}e{found[2] or found[3] or 0}")


class LegacyError(ContentError):
    """A legacy file that cannot be read or mapped; says file, line, what was found and the remedy."""


class Reader:
    """Lines of one file that carry something: comments (! or # in column 1) and blank lines are passed over."""

    def __init__(self, path):
        self.path = Path(path)
        try:
            raw = self.path.read_bytes().decode("latin-1").split("\n")
        except OSError as error:
            raise LegacyError(f"{self.path}: cannot be read ({error.strerror}); give a folder that holds it") from error
        self.lines = [(n, line.rstrip()) for n, line in enumerate(raw, 1) if line.strip() and line[0] not in "!#"]
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

    @property
    def number_of_line(self):
        """Number in the file, from 1, of the line just read; 0 before the first."""
        return self.lines[min(self.at, len(self.lines)) - 1][0] if self.at else 0

    def fail(self, text):
        """Refuses the line just read."""
        raise LegacyError(f"{self.path}, line {self.number_of_line}: {text}")

    def number(self, line, first, last, blank=None):
        """The real number in columns first to last, from 1, as the Fortran format D14.7 takes it. blank: what an empty field
        stands for; None refuses it."""
        text = line[first - 1 : last].replace(" ", "").replace("\t", "")
        if not text and blank is not None:
            return blank
        found = REAL.fullmatch(text)
        if found is None:
            self.fail(f"columns {first}-{last} hold {text!r}, not a number")
        value = fortran(found)
        if "." not in found[1] and value != 0:
            self.fail(f"columns {first}-{last} hold {text!r}, which LMGC90 reads as {value * 1e-7:g}: write a decimal point")
        if not math.isfinite(value):
            self.fail(f"columns {first}-{last} hold {text!r}, more than a number can hold")
        return value

    def whole(self, line, first, last):
        """The whole number that starts in columns first to last, from 1."""
        text = line[first - 1 : last].strip()
        if not re.match(r"[+-]?\d+(\s|$)", text):
            self.fail(f"columns {first}-{last} hold {text!r}, not a whole number")
        return int(text.split()[0])

    def values(self, line, count, columns=(30, 51, 72), blank=None):
        """The first `count` numbers of the line, whatever their labels: it is the columns that count."""
        return [self.number(line, c + 5, c + 18, blank) for c in columns[:count]]

    def header(self, line):
        """Type and number of a body line."""
        kind, number = line[1:6].strip(), line[8:15].replace(" ", "")
        if not kind or not re.fullmatch(r"\d+", number):
            self.fail(f"{line.strip()!r} is no header of a body: its type in columns 2-6 and number in 9-15 were expected")
        return kind, int(number)


def real(value):
    """A number as LMGC90 reads it, 14 columns."""
    return f"{value:14.7E}"


def triple(labels, values):
    """A line of up to three labels and values, from column 30."""
    words = "".join(f"{label:<5}{real(v)}  " for label, v in zip(labels, values))
    return " " * 29 + words.rstrip()
