"""Read, measure and draw what a simulation wrote."""

from .errors import FileError
from .fragments import fragments
from .load import Run, load
from .writer import RunWriter

__all__ = ["FileError", "Run", "RunWriter", "fragments", "load"]
