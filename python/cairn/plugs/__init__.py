"""Laws and routines of a user's own: compiled, wrapped and plugged in.

INCLUDE: the folder of the files that subroutines of Abaqus's interface include, for the compiler's -I.
"""

from pathlib import Path

INCLUDE = str(Path(__file__).resolve().parent / "include")
