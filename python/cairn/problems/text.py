"""Frictional contact problems in the text layouts of Siconos: W dense or in blocks.

dim, contacts, kind of W (0 dense, 1 blocks), its two sizes, W, q, mu. Dense: the two sizes again, then column by column.
Blocks: how many, block rows and columns, where each block row and column ends, the lengths of the starts and columns, these,
and each block's number before its values, columns of a block contiguous.
"""

from __future__ import annotations

import numpy as np

from .fclib import ProblemFileError
from .problem import Problem


def read(path):
    """The Problem of a text file."""
    try:
        with open(path, encoding="ascii") as file:
            words = file.read().split()
    except FileNotFoundError as error:
        raise ProblemFileError(f"{path}: there is no such file") from error
    except (OSError, UnicodeDecodeError) as error:
        raise ProblemFileError(f"{path}: is no text ({error})") from error
    try:
        return _read(_Words(words))
    except (ValueError, IndexError) as error:
        raise ProblemFileError(f"{path}: {error}") from error


class _Words:
    def __init__(self, words):
        self.words, self.place = words, 0

    def take(self, count, kind, what):
        end = self.place + count
        if end > len(self.words):
            raise ValueError(f"ends before {what} is whole: {count} numbers were due, {len(self.words) - self.place} are left")
        values = np.array(self.words[self.place : end], dtype=kind)
        self.place = end
        return values

    def number(self, what):
        return int(self.take(1, int, what)[0])


def _read(words):
    dim, contacts, kind = words.number("dim"), words.number("the number of contacts"), words.number("the kind of W")
    sizes = words.take(2, int, "the size of W")
    if tuple(sizes) != (dim * contacts, dim * contacts):
        raise ValueError(f"W is {sizes[0]} x {sizes[1]}, but {contacts} contacts in {dim}D need {dim * contacts}")
    if kind == 0:
        words.take(2, int, "the size of W")
        W = words.take(sizes[0] * sizes[1], float, "W").reshape(sizes, order="F")
    elif kind == 1:
        W = _read_blocks(words, dim, contacts)
    else:
        raise ValueError(f"W is of kind {kind}: 0 (dense) and 1 (blocks) are known; sparse ones keep six digits only")
    return Problem(dim, W, words.take(dim * contacts, float, "q"), words.take(contacts, float, "mu"))


def _read_blocks(words, dim, contacts):
    from scipy import sparse

    count = words.number("the number of blocks")
    rows, columns = words.number("the block rows"), words.number("the block columns")
    for what, many in (("ends of block rows", rows), ("ends of block columns", columns)):
        ends = words.take(many, int, what)
        if many != contacts or (ends != dim * np.arange(1, contacts + 1)).any():
            raise ValueError(f"{what} are not the multiples of {dim}: blocks must be contacts")
    filled = words.take(2, int, "the lengths of starts and columns")
    starts, places = words.take(filled[0], int, "starts"), words.take(filled[1], int, "columns")
    # rows at the end that are empty need no start
    starts = np.concatenate([starts, np.full(contacts + 1 - starts.size, starts[-1])])
    numbered = words.take(count * (dim * dim + 1), float, "W").reshape(count, dim * dim + 1)
    if (numbered[:, 0] != np.arange(count)).any():
        raise ValueError(f"blocks are not numbered from 0 to {count - 1}")
    data = numbered[:, 1:].reshape(count, dim, dim).transpose(0, 2, 1)
    size = dim * contacts
    return sparse.bsr_array((np.ascontiguousarray(data), places, starts), shape=(size, size))


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
