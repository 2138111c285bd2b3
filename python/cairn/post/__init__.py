"""Read, measure and draw what a simulation wrote."""

import sys

from ..base.errors import FileError
from ..files import checkpoint
from ..files.writer import RunWriter
from .acoustic import AcousticEvents
from .fragments import fragments
from .load import Run, load

__all__ = ["AcousticEvents", "FileError", "Run", "RunWriter", "fragments", "load"]
sys.modules[f"{__name__}.checkpoint"] = checkpoint  # its name up to version 0.2
