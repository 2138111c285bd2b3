"""Read, measure and draw what a simulation wrote."""

from .acoustic import AcousticEvents
from .errors import FileError
from .fragments import fragments
from .load import Run, load
from .writer import RunWriter

__all__ = ["AcousticEvents", "FileError", "Run", "RunWriter", "fragments", "load"]
