"""Networks of potential and temperature: heat and current between bodies, through their contacts.

import cairn as cn

steel = cn.Material("steel", density=7800.0, young=2e11, poisson=0.3, resistivity=1.7e-7)
scene.electrical(conductance=cn.networks.Holm(), current={"lid": 0.2, "floor": -0.2})
sim = cn.Simulation(scene, dt=1e-3)
sim.step()["electrical"]         # status, current, power, closure, balance
sim.bodies.potential             # (n,) [V]
sim.contacts.current             # (m,) [A]

`solve` and `resistance` take a graph of conductances without any scene.
"""

from .. import names
from ..base.materials import OfTemperature
from .conductances import CONDUCTANCES, Conductance, OxideFilm, plug
from .graphs import Flow, resistance, solve
from .settings import Electrical, NetworkWarning, Thermal

globals().update(CONDUCTANCES)  # Holm, Sharvin, ...: a class for each row of the kernels' list

__all__ = ["Conductance", "Electrical", "Flow", "NetworkWarning", "OfTemperature", "OxideFilm", "Thermal", "plug", "resistance",
           "solve", *CONDUCTANCES]  # fmt: skip
names.teach(globals(), __all__)
