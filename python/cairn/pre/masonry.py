"""Generators of masonry, under one roof: arches, vaults, domes, walls, columns, stairs, bridges, cut volumes, stones.

Each returns cairn.pre.blocks.Blocks; `blocks.sets(material)` makes bodies of them, `mesh` deformable ones.
"""

from .arches import arch
from .block_meshes import MeshedBlocks, mesh
from .blocks import Blocks, Joints
from .bridges import Tier, bridge, pont_du_gard
from .facades import facade
from .stones import random_polygons, random_polyhedra, voronoi
from .vaults import barrel_vault, cross_vault, dome, groin_vault
from .walls import column, panel, stairs, wall

__all__ = [
    "Blocks",
    "Joints",
    "MeshedBlocks",
    "Tier",
    "arch",
    "barrel_vault",
    "bridge",
    "column",
    "cross_vault",
    "dome",
    "facade",
    "groin_vault",
    "mesh",
    "panel",
    "pont_du_gard",
    "random_polygons",
    "random_polyhedra",
    "stairs",
    "voronoi",
    "wall",
]
