"""Making scenes: grain sizes, dense deposits, lattices, walls and clumps, as plain numpy arrays."""

import sys

from ..base import checks
from . import clumps, grains, lattices, masonry, mass_properties, mesh
from .clumps import clump
from .decompose import convex_parts
from .deposits import deposit_disks, deposit_spheres, layers, solid_fraction
from .lattices import box_walls, lattice

__all__ = [
    "box_walls",
    "clump",
    "clumps",
    "convex_parts",
    "deposit_disks",
    "deposit_spheres",
    "grains",
    "lattice",
    "lattices",
    "layers",
    "masonry",
    "mass_properties",
    "mesh",
    "solid_fraction",
]

sys.modules[f"{__name__}.checks"] = checks  # its name up to version 0.2
