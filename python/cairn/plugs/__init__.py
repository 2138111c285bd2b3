"""Users' laws and routines: templates, wrappers and plugged libraries.

INCLUDE: folder of the include files for subroutines of Abaqus's interface, for the compiler's -I.
"""

from pathlib import Path

INCLUDE = str(Path(__file__).resolve().parent / "include")
