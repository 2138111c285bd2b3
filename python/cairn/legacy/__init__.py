"""Exchange with LMGC90: reads DATBOX folders as scenes, writes scenes as DATBOX folders, reads stored results."""

from ..names import teach
from .contact_laws import LAWS
from .report import account
from .results import Instant, read_contacts, read_dof, read_h5, read_outbox, read_results
from .scene import Origin, UnmappedWarning, read_datbox
from .text import LegacyError
from .write import write_datbox

__all__ = [
    "LAWS",
    "Instant",
    "LegacyError",
    "Origin",
    "UnmappedWarning",
    "account",
    "read_contacts",
    "read_datbox",
    "read_dof",
    "read_h5",
    "read_outbox",
    "read_results",
    "write_datbox",
]

teach(globals(), __all__)
