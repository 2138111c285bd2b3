"""Frictional contact problems in the text layouts of Siconos, local and global, with dense, block and sparse matrices.

Local: dim, contacts, W, q, mu. Global: dim, contacts, M, H, q, b, mu, of M v = H r + q, u = H' v + b. A matrix: its kind
(0 dense, 1 blocks, 2 sparse) and its two sizes. Dense: the two sizes again, then column by column. Blocks: how many; where
there are some, block rows and columns, where each block row and column ends, the lengths of the starts and columns, these, and
each block's number before its values, columns of a block contiguous. Sparse: 1 (triplets), 2 (columns) or 3 (rows), a line on
who printed it, a line with its sizes and how many entries it has, and these, to six digits as Siconos prints them. Old files
end with a flag, 0 or 1.
"""

from __future__ import annotations

import re

import numpy as np

from .fclib import ProblemFileError, reduce_global
from .problem import Problem

KINDS = ("dense", "blocks", "sparse")
HEADER = re.compile(r"(triplet: |csr: |)(\d+)-by-(\d+), nzmax: (\d+) nnz: (\d+)(, 1-norm: \S+)?")


def read(path):
    """The Problem of a text file; a global one is reduced to its contacts."""
    try:
        with open(path, "rb") as file:
            data = file.read()
    except FileNotFoundError as error:
        raise ProblemFileError(f"{path}: there is no such file; check the path") from error
    except OSError as error:
        raise ProblemFileError(f"{path}: cannot be read ({error})") from error
    try:
        return _read(_Words(_text(data)))
    except (ValueError, IndexError) as error:
        raise ProblemFileError(f"{path}: {error}") from error
    except (OverflowError, MemoryError, TypeError) as error:
        raise ProblemFileError(f"{path}: {type(error).__name__}: {error}: its sizes are too large") from error


def _text(data):
    try:
        return data.decode("ascii")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ValueError(f"line {line}: holds the byte {data[error.start]:#04x}: give plain text (ASCII)") from error


class _Words:
    """Words of a text, taken one after the other, and the lines they stand in."""

    def __init__(self, text):
        lines = [line.split() for line in text.split("\n")]
        self.words = [word for line in lines for word in line]
        self.ends = np.cumsum([len(line) for line in lines])
        self.place = 0

    def line(self, place=None):
        """Number of the line that holds the word at a place (the next one, if none is given), or that the text ends with."""
        place = min(self.place if place is None else place, len(self.words) - 1)
        return int(np.searchsorted(self.ends, place, side="right")) + 1

    def left(self):
        return len(self.words) - self.place

    def bad(self, why, place=None):
        return ValueError(f"line {self.line(place)}: {why}")

    def texts(self, count, what):
        """The next words as they are."""
        if count > self.left():
            why = f"the file ends before {what} is whole: {count} words were due, {self.left()} are left"
            raise self.bad(why, len(self.words))
        self.place += count
        return self.words[self.place - count : self.place]

    def rest_of_line(self):
        end = int(self.ends[self.line() - 1]) if self.left() else self.place
        return " ".join(self.texts(end - self.place, "a line"))

    def take(self, count, kind, what):
        """The next numbers; kind: int or float."""
        first = self.place
        return self.numbers(self.texts(count, what), kind, what, first, 1)

    def numbers(self, words, kind, what, first, step):
        """Words as numbers; they stand at the places first, first + step, ... of the text."""
        try:
            values = np.array(words, dtype=kind)
            good = np.isfinite(values).all() and not any("_" in word for word in words)
        except (ValueError, OverflowError):
            good = False
        if good:
            return values
        for k, word in enumerate(words):
            if not _is_number(word, kind):
                wanted = "a whole number" if kind is int else "a finite number"
                raise self.bad(f"{word!r} is no number of {what}: {wanted} is due", first + step * k)
        raise self.bad(f"{what} holds words that are no numbers", first)

    def number(self, what):
        value = int(self.take(1, int, what)[0])
        if value < 0:
            raise self.bad(f"{what} is {value}: give 0 or more", self.place - 1)
        return value


def _is_number(word, kind):
    try:
        value = kind(word)
    except ValueError:
        return False
    return "_" not in word and (np.isfinite(value) if kind is float else abs(value) < 2**63)


def _read(words):
    dim = words.number("dim")
    if dim not in (2, 3):
        raise words.bad(f"dim is {dim}: 2 and 3 are known (5 is of rolling friction)", words.place - 1)
    contacts = words.number("the number of contacts")
    size = dim * contacts
    first = words.place
    M = _read_matrix(words, "the first matrix")
    if M.shape[0] != M.shape[1]:
        raise words.bad(f"the first matrix is {M.shape[0]} x {M.shape[1]}: a square one is due", first)
    local = M.shape == (size, size)
    if _second_matrix(words, (M.shape[0], size)) and not (local and words.left() <= size + contacts + 1):
        H = _read_matrix(words, "H")
        q, b = words.take(M.shape[0], float, "q"), words.take(size, float, "b")
        mu = words.take(contacts, float, "mu")
        _nothing_left(words)
        return reduce_global(dim, M, H, q, b, mu)
    if not local:
        raise words.bad(
            f"the first matrix is {M.shape[0]} x {M.shape[1]}: it is no W, {contacts} contacts in {dim}D need {size}; and no M "
            f"either, a matrix H of {M.shape[0]} x {size} does not follow"
        )
    q, mu = words.take(size, float, "q"), words.take(contacts, float, "mu")
    _nothing_left(words)
    return Problem(dim, M, q, mu)


def _second_matrix(words, shape):
    """True if kind and sizes of a matrix of this shape come next: the problem is a global one."""
    kind, *sizes = [*words.words[words.place : words.place + 3], ""][:3]
    return kind in ("0", "1", "2") and sizes == [str(n) for n in shape]


def _nothing_left(words):
    if words.left() == 1 and words.words[-1] in ("0", "1"):
        return  # the flag of old files
    if words.left():
        raise words.bad(f"{words.left()} words are left over, from {words.words[words.place]!r} on: nothing may follow mu")


def _read_matrix(words, what):
    """A matrix of any kind; scipy.sparse.coo_array unless dense."""
    first = words.place
    kind = words.number(f"the kind of {what}")
    if kind >= len(KINDS):
        raise words.bad(f"{what} is of kind {kind}: 0 (dense), 1 (blocks) and 2 (sparse) are known", first)
    shape = words.number(f"the rows of {what}"), words.number(f"the columns of {what}")
    return (_read_dense, _read_blocks, _read_sparse)[kind](words, shape, what)


def _read_dense(words, shape, what):
    first = words.place
    again = words.number(f"the rows of {what}"), words.number(f"the columns of {what}")
    if again != shape:
        raise words.bad(f"{what} is {again[0]} x {again[1]} here and {shape[0]} x {shape[1]} before", first)
    return words.take(shape[0] * shape[1], float, what).reshape(shape, order="F")


def _read_blocks(words, shape, what):
    from scipy import sparse

    count = words.number(f"the number of blocks of {what}")
    if count == 0:
        return sparse.coo_array(shape)
    many = words.number(f"the block rows of {what}"), words.number(f"the block columns of {what}")
    first_row = _starts(words, many[0], shape[0], f"the ends of block rows of {what}")
    first_column = _starts(words, many[1], shape[1], f"the ends of block columns of {what}")
    filled = words.number(f"the length of the starts of {what}"), words.number(f"the length of the columns of {what}")
    place = words.place
    starts, columns = words.take(filled[0], int, f"the starts of {what}"), words.take(filled[1], int, f"the columns of {what}")
    # rows at the end that are empty need no start
    if not 1 <= filled[0] <= many[0] + 1 or starts[0] != 0 or starts[-1] != count or (np.diff(starts) < 0).any():
        raise words.bad(f"the starts of {what} do not rise from 0 to its {count} blocks in {many[0]} rows or fewer", place)
    if filled[1] != count or ((columns < 0) | (columns >= many[1])).any():
        why = f"the columns of {what} are {filled[1]}, as many as blocks ({count}) are due, 0 to {many[1] - 1} each"
        raise words.bad(why, place + filled[0])
    rows = np.repeat(np.arange(filled[0] - 1), np.diff(starts))
    height, width = np.diff(first_row)[rows], np.diff(first_column)[columns]
    ends = np.cumsum(height * width + 1)
    place = words.place
    numbered = words.take(int(ends[-1]), float, what)
    begins = np.concatenate([[0], ends[:-1]])
    wrong = np.flatnonzero(numbered[begins] != np.arange(count))
    if wrong.size:
        k = int(wrong[0])
        raise words.bad(f"a block of {what} has number {numbered[begins[k]]:g}: {k} is due", place + int(begins[k]))
    block = np.repeat(np.arange(count), height * width)
    inside = np.arange(block.size) - np.repeat(begins - np.arange(count), height * width)
    i, j = first_row[rows[block]] + inside % height[block], first_column[columns[block]] + inside // height[block]
    return sparse.coo_array((np.delete(numbered, begins), (i, j)), shape=shape)


def _starts(words, many, size, what):
    """Start of each block row or column, from the ends."""
    first = words.place
    starts = np.concatenate([[0], words.take(many, int, what)])
    if (np.diff(starts) <= 0).any() or starts[-1] != size:
        raise words.bad(f"{what} do not rise to {size}", first)
    return starts


def _read_sparse(words, shape, what):
    from scipy import sparse

    origin = words.number(f"the storage of {what}")
    if origin not in (1, 2, 3):
        raise words.bad(f"{what} is stored as {origin}: 1 (triplets), 2 (columns) and 3 (rows) are known", words.place - 1)
    words.rest_of_line()  # says who printed it
    first = words.place
    header = HEADER.fullmatch(words.rest_of_line())
    if header is None or header[1] != {1: "triplet: ", 2: "", 3: "csr: "}[origin]:
        due = {1: "triplet: m-by-n, ...", 2: "m-by-n, ...", 3: "csr: m-by-n, ..."}[origin]
        raise words.bad(f"no sizes of {what} as {due}, nzmax: k nnz: k", first)
    sizes, entries = (int(header[2]), int(header[3])), int(header[5])
    if sizes != shape:
        raise words.bad(f"{what} is {sizes[0]} x {sizes[1]} here and {shape[0]} x {shape[1]} before", first)
    if origin == 1:
        i, j, x = _triplets(words, entries, what)
    else:
        lines, inside, x = _compressed(words, entries, "col" if origin == 2 else "row", what)
        i, j = (inside, lines) if origin == 2 else (lines, inside)
    for index, limit, which in ((i, shape[0], "row"), (j, shape[1], "column")):
        wrong = np.flatnonzero((index < 0) | (index >= limit))
        if wrong.size:
            raise words.bad(f"{what} has an entry in {which} {index[wrong[0]]}: it goes from 0 to {limit - 1}", first)
    return sparse.coo_array((x, (i, j)), shape=shape)


def _entries(words, count, what, indices):
    """Indices (count, indices) and values (count) of entries 'i : x' or 'i j : x'."""
    first, width = words.place, indices + 2
    taken = words.texts(count * width, what)
    for k, word in enumerate(taken[indices::width]):
        if word != ":":
            raise words.bad(f"{word!r} stands where ':' is due in an entry of {what}", first + k * width + indices)
    index = [words.numbers(taken[a::width], int, what, first + a, width) for a in range(indices)]
    return index, words.numbers(taken[indices + 1 :: width], float, what, first + indices + 1, width)


def _triplets(words, entries, what):
    (i, j), x = _entries(words, entries, what, 2)
    return i, j, x


def _compressed(words, entries, name, what):
    """Which column (name "col") or row each entry is in, its index there, and its value."""
    owner, inside, values, seen, number = [], [], [], 0, 0
    while words.left() and words.words[words.place] == name:
        first = words.place
        line = words.texts(7, what)
        if [line[k] for k in (2, 3, 5)] != [":", "locations", "to"]:
            raise words.bad(f"{' '.join(line)!r} is no head of a {name} of {what}: '{name} j : locations a to b' is due", first)
        mine, start, last = words.numbers([line[1], line[4], line[6]], int, what, first, 1).tolist()
        if mine != number or start != seen or last < start - 1:
            raise words.bad(f"{name} {mine} of {what} from {start} to {last}: {name} {number} from {seen} on is due", first)
        (index,), x = _entries(words, last - start + 1, what, 1)
        owner.append(np.full(x.size, mine))
        inside.append(index)
        values.append(x)
        seen, number = last + 1, number + 1
    if seen != entries:
        raise words.bad(f"{what} has {seen} entries: {entries} were told", words.place)
    return tuple(np.concatenate([np.zeros(0, kind), *parts]) for kind, parts in ((int, owner), (int, inside), (float, values)))


def write(path, problem, *, dense=False):
    """Writes a problem as text, W in blocks or dense, every digit kept."""
    W = problem.W
    with open(path, "w", encoding="ascii") as file:
        file.write(f"{problem.dim}\n{problem.contacts}\n{0 if dense else 1}\n{W.shape[0]}\n{W.shape[1]}\n")
        if dense:
            file.write(f"{W.shape[0]}\t{W.shape[1]}\n")
            np.savetxt(file, W.toarray().T, fmt="%.17e")
        else:
            n = problem.contacts
            ends = "\t".join(str(problem.dim * (a + 1)) for a in range(n))
            file.write(f"{W.indices.size}\n{n}\n{n}\n{ends}\n{ends}\n{n + 1}\n{W.indices.size}\n")
            file.write("\t".join(map(str, W.indptr)) + "\n" + "\t".join(map(str, W.indices)) + "\n")
            for number, block in enumerate(W.data.transpose(0, 2, 1)):
                file.write(f"{number}\n" + "\n".join(f"{x:.17e}" for x in block.ravel()) + "\n")
        file.write(" ".join(f"{x:.17e}" for x in problem.q.ravel()) + "\n")
        file.write(" ".join(f"{x:.17e}" for x in problem.mu) + "\n")
