"""Report of an import of blocks, its warning and its error, and the bodies of a file before they are blocks."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..base.errors import DAMAGE, ContentError, FileError
from .closed_surfaces import MeshError


class BlocksWarning(UserWarning):
    """Something about blocks that may not be meant: the unit of their file or of a load, or joints that they do not have."""


@dataclass(frozen=True)
class ImportReport:
    """Report of an import. blocks: number of blocks; closed: number whose surface was closed in the file; repaired: repairs made,
    by block; hulls: blocks replaced by their convex hulls; volume [m3] (area in 2D); smallest_edge [m]; overlaps (k, 2) blocks
    and overlap_depth (k,) [m]; joints: how many pairs of faces lie on each other; flattened [m]: largest displacement of a corner
    to make faces plane; parts: number of convex parts of all blocks; names: of each block, "" where the file has none; hints:
    likely mistakes in the file, each also a BlocksWarning; extent (dim,) [m] of all blocks along the axes; unit: that of the
    file, "" where it tells none; scale: the factor given to read it."""

    blocks: int
    closed: int
    repaired: dict
    hulls: list
    volume: float
    smallest_edge: float
    overlaps: np.ndarray
    overlap_depth: np.ndarray
    joints: int
    flattened: float = 0.0
    parts: int = 0
    names: tuple = ()
    hints: tuple = ()
    extent: tuple = ()
    unit: str = ""
    scale: float = 1.0

    def __str__(self):
        times = f" x {self.scale:g}" if self.scale != 1 else ""
        unit = f"{self.unit}, by the file" if self.unit else "not told by the file, taken as the metre"
        lines = [
            f"{self.blocks} blocks, {self.closed} closed as they came, {len(self.repaired)} repaired, {len(self.hulls)} hulls"
            + (f", {self.parts} convex parts" if self.parts > self.blocks else ""),
            f"extent {' x '.join(f'{x:.4g}' for x in self.extent)} m; unit {unit}{times}",
            f"volume {self.volume:.6g}, smallest edge {self.smallest_edge:.3g} m, {self.joints} joints",
            f"{len(self.overlaps)} overlaps"
            + (f", the deepest {self.overlap_depth.max():.3g} m" if len(self.overlaps) else ""),
        ]
        if self.flattened:
            lines.append(f"corners moved by at most {self.flattened:.2g} m, so that faces are plane")
        lines += [f"block {k}: {'; '.join(done)}" for k, done in list(self.repaired.items())[:5]]
        lines += [f"look: {hint}" for hint in self.hints]
        return "\n".join(lines)


class BlocksFileError(ContentError, MeshError):
    """A file of blocks that cannot be read, or whose surfaces bound none. fault, items: as of a MeshError, "" and none else."""

    def __init__(self, path, error):
        text = str(error) if isinstance(error, ValueError) else f"cannot be read ({type(error).__name__}: {error})"
        name = Path(path).name
        within = text.removeprefix(name)
        apart = "" if within.startswith((",", ":", " ")) else ": "
        ContentError.__init__(self, f"{path}{apart}{within}", "mend it, or write it again by the program that made it")
        self.path = str(path)
        self.fault, self.items = getattr(error, "fault", ""), getattr(error, "items", np.zeros(0, int))


@contextlib.contextmanager
def told_of(path):
    """Turns exceptions raised within the context by a file of blocks into BlocksFileError."""
    try:
        yield
    except FileError:
        raise
    except (*DAMAGE, ArithmeticError, SystemExit) as error:
        raise BlocksFileError(path, error) from error


@dataclass
class Raw:
    """Bodies as stored in a file. soups: (vertices, faces, part, name) of one or more bodies, whose corners may be shared;
    bodies: for each a list of surfaces (vertices, faces), of polygons in 2D; parts: part name of each body; names: own name of
    each body where the file has one; in_metres: true if the file tells its unit, so that lengths are in metres; unit: its
    name."""

    dim: int = 3
    soups: list = field(default_factory=list)
    bodies: list = field(default_factory=list)
    parts: list = field(default_factory=list)
    names: dict = field(default_factory=dict)
    in_metres: bool = False
    unit: str = ""

    def label(self, file, k):
        """How errors name a body."""
        return f"{file}, block {k}" + (f" ({self.names[k]})" if self.names.get(k) else "")
