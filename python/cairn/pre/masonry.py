"""Generators of masonry, under one roof: arches, vaults, domes, walls, columns, stairs, bridges, cut volumes, stones.

Each returns cairn.pre.blocks.Blocks; `blocks.sets(material)` makes bodies of them.
"""

from .arches import arch
from .blocks import Blocks, Joints
from .bridges import Tier, bridge, pont_du_gard
from .walls import column, panel, stairs, wall

__all__ = ["Blocks", "Joints", "Tier", "arch", "bridge", "column", "panel", "pont_du_gard", "stairs", "wall"]
