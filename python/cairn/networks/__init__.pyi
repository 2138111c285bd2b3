# written by script/stubs.py from the lists of the core: change those, and run it

from typing import Any

from .. import names as names
from ..base.materials import OfTemperature as OfTemperature
from .conductances import CONDUCTANCES as CONDUCTANCES
from .conductances import Conductance as Conductance
from .conductances import OxideFilm as OxideFilm
from .conductances import plug as plug
from .graphs import Flow as Flow
from .graphs import resistance as resistance
from .graphs import solve as solve
from .settings import Electrical as Electrical
from .settings import NetworkWarning as NetworkWarning
from .settings import Thermal as Thermal

class Constant(Conductance):
    def __init__(self, *, conductance: float) -> None: ...

class Holm(Conductance):
    def __init__(self) -> None: ...

class PlasticSpot(Conductance):
    def __init__(self, *, hardness: float = 0.0) -> None: ...

class Sharvin(Conductance):
    def __init__(self, *, free_path: float) -> None: ...

class Wexler(Conductance):
    def __init__(self, *, free_path: float) -> None: ...

class HertzStrip(Conductance):
    def __init__(self) -> None: ...

class Yovanovich(Conductance):
    def __init__(self, *, slope: float, roughness: float, hardness: float = 0.0, area: float = 0.0) -> None: ...

class GasGap(Conductance):
    def __init__(self, *, conductivity: float, jump: float = 0.0, area: float = 0.0) -> None: ...

class Cohesive(Conductance):
    def __init__(self, *, intact: float, broken: float = 0.0, area: float = 0.0) -> None: ...

class Given(Conductance):
    def __init__(self, *, pressures: Any, gaps: Any, h: Any, area: float) -> None: ...

class LegacyAllno(Conductance):
    def __init__(self) -> None: ...

class LegacyHertz(Conductance):
    def __init__(self) -> None: ...

class LegacyHolmH(Conductance):
    def __init__(self) -> None: ...

class LegacyHolmP(Conductance):
    def __init__(self) -> None: ...

class LegacyTkaya(Conductance):
    def __init__(self) -> None: ...

class LegacyDiscrete(Conductance):
    def __init__(self) -> None: ...
