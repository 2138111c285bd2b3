"""Reader of LMGC90's text files: blocks that start with $, values in fixed columns. Errors name file, line and column."""

from __future__ import annotations

import math
import re
from pathlib import Path

from ..base.errors import ContentError

# A Fortran number: mantissa and exponent, whose letter is optional before a sign.
REAL = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[dDeEqQ]?([+-]\d+)|[dDeEqQ](\d+))?")


def fortran(found):
    """Value of a match of REAL."""
    return float(f"{found[1]}e{found[2] or found[3] or 0}")


class LegacyError(ContentError):
    """Error for a legacy file that cannot be read or mapped; tells file, line, content and remedy."""


class Reader:
    """Lines of a file without blank lines and comments (! or # in column 1)."""

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
        """Current line, "" past the end."""
        return self.lines[self.at][1] if self.at < len(self.lines) else ""

    @property
    def ended(self):
        """True past the last line."""
        return self.at >= len(self.lines)

    def next(self):
        """Returns the current line and advances. Raises LegacyError at the end of the file."""
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
        """Raises LegacyError for the line just read."""
        raise LegacyError(f"{self.path}, line {self.number_of_line}: {text}")

    def number(self, line, first, last, blank=None):
        """Real number in columns first to last, from 1, as read by the Fortran format D14.7. blank: value of an empty field, None
        to refuse it."""
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
        """Whole number that starts in columns first to last, from 1."""
        text = line[first - 1 : last].strip()
        if not re.match(r"[+-]?\d+(\s|$)", text):
            self.fail(f"columns {first}-{last} hold {text!r}, not a whole number")
        return int(text.split()[0])

    def values(self, line, count, columns=(30, 51, 72), blank=None):
        """First `count` numbers of a line, by columns; labels are ignored."""
        return [self.number(line, c + 5, c + 18, blank) for c in columns[:count]]

    def header(self, line):
        """(type, number) of a body from its header line."""
        kind, number = line[1:6].strip(), line[8:15].replace(" ", "")
        if not kind or not re.fullmatch(r"\d+", number):
            self.fail(f"{line.strip()!r} is no header of a body: its type in columns 2-6 and number in 9-15 were expected")
        return kind, int(number)


def real(value):
    """Text of a number in 14 columns, for LMGC90."""
    return f"{value:14.7E}"


def triple(labels, values):
    """A line of up to three labels and values, from column 30."""
    words = "".join(f"{label:<5}{real(v)}  " for label, v in zip(labels, values))
    return " " * 29 + words.rstrip()
