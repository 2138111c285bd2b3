"""Making scenes: grain sizes, dense deposits, lattices, walls and clumps, as plain numpy arrays."""

from . import grains

__all__ = ["grains"]
