"""Cairn: mechanics of divided media, by Non-Smooth Contact Dynamics.

import cairn as cn

rock = cn.Material("rock", density=2800.0)
scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
scene.add(cn.disks(centers, radii, rock), cn.wall(point=(0, 0), normal=(0, 1), material=rock))
scene.interact(rock, rock, cn.Coulomb(mu=0.4))
sim = cn.Simulation(scene, dt=1e-3)
sim.run(steps=2000, output="pile.vtkhdf", every=20)
"""

from . import _openmp  # noqa: F401  # isort: skip
from . import _core, names, pre
from ._core import Error
from .base.errors import FileError
from .base.materials import Material
from .base.time_functions import Expression, Harmonic, Servo, Table
from .model import laws
from .model.bodies import BodySet, ContactorSet, clumps, disks, spheres
from .model.boundaries import box, ring, segment, tube, wall
from .model.grain_laws import granular, interact_by_mixing, mix
from .model.joints import Ball, Cable, Distance, Fixed, Hinge, Motor, Pivot, Slider, Spring
from .model.laws import Law
from .model.missing_laws import MissingLawWarning
from .model.periodic import Periodic
from .model.round_shapes import capsules, cylinders, superquadrics
from .model.scene import Scene
from .model.shapes import boxes, polygons, polyhedra, with_corners
from .options import integrators, solvers, strategies
from .options.strategies import NSCD, Carpenter, GranularElement, SmoothDEM, strategy
from .plugs.plug import plug
from .post.load import load
from .run.probes import Probe
from .run.scene_warnings import SceneWarning
from .run.simulation import Simulation
from .run.step_warnings import (
    EnergyCreatedWarning,
    JointWarning,
    OverlapWarning,
    RunawayWarning,
    StableStepWarning,
    TunnellingWarning,
    TurnedWarning,
    UnjoinedWarning,
)
from .run.unit_warnings import UnitsWarning
from .run.unmet_shapes import ShapesWarning

_LATER = {
    "ElasticBody": "model.elastic",
    "LinearBody": "model.meshes",
    "BodyStep": "model.callbacks",
    "CallbackBody": "model.callbacks",
    "SolidBody": "model.solid",
    "fluid": "model.fluids",
    "FreeSlip": "model.fluids",
    "GrainDrag": "model.fluids",
    "Inflow": "model.fluid_ends",
    "Outflow": "model.fluid_ends",
    "NoSlip": "model.fluids",
    "bars": "model.frames",
    "beams": "model.frames",
    "deformable": "model.meshes",
    "tied": "model.ties",
    "find_equilibrium": "run.equilibrium",
    "open_series": "post.series",
    "surface": "model.surfaces",
}
_LATER |= dict.fromkeys([d["python_name"] for d in _core.bulk_materials()], "model.bulk")
_PARTS = {
    "fracture": "model.fracture", "legacy": "legacy", "networks": "networks", "precice": "run.precice", "problems": "problems",
    "soe": "run.soe", "study": "study",
}


def __getattr__(name):  # names that few scenes need are imported on first use
    import importlib

    if name in _PARTS:
        return importlib.import_module(f".{_PARTS[name]}", __name__)
    if name in _LATER:
        globals()[name] = getattr(importlib.import_module(f".{_LATER[name]}", __name__), name)
        names.teach(globals(), [name])
        return globals()[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}{names.meant(name, __all__)}")


def __dir__():
    return sorted({*globals(), *_LATER, *_PARTS})


globals().update(laws.LAWS)  # Coulomb, Restitution, ...: a class for each row of the kernels' list
globals().update(solvers.SOLVERS)  # NLGS, Auto, PPANewton, ...
globals().update(integrators.INTEGRATORS)  # Theta, Newmark, HHT, ...: a class for each row of the kernels' list
globals().update(strategies.STRATEGIES)  # a class for each row of the core's list

__version__ = _core.build_info()["version"]
__all__ = [
    "NSCD",
    "Ball",
    "BodySet",
    "BodyStep",
    "Cable",
    "CallbackBody",
    "Carpenter",
    "ContactorSet",
    "Distance",
    "ElasticBody",
    "EnergyCreatedWarning",
    "JointWarning",
    "Error",
    "Expression",
    "FileError",
    "Fixed",
    "FreeSlip",
    "GrainDrag",
    "GranularElement",
    "Harmonic",
    "Hinge",
    "Inflow",
    "Law",
    "LinearBody",
    "Material",
    "MissingLawWarning",
    "Motor",
    "NoSlip",
    "Outflow",
    "OverlapWarning",
    "Periodic",
    "Pivot",
    "Probe",
    "RunawayWarning",
    "Scene",
    "SceneWarning",
    "Servo",
    "ShapesWarning",
    "Simulation",
    "SmoothDEM",
    "Slider",
    "Spring",
    "StableStepWarning",
    "Table",
    "TunnellingWarning",
    "TurnedWarning",
    "UnitsWarning",
    "UnjoinedWarning",
    "box",
    "boxes",
    "capsules",
    "clumps",
    "cylinders",
    "deformable",
    "disks",
    "find_equilibrium",
    "fluid",
    "granular",
    "interact_by_mixing",
    "load",
    "mix",
    "open_series",
    "plug",
    "polygons",
    "polyhedra",
    "pre",
    "ring",
    "segment",
    "spheres",
    "strategy",
    "superquadrics",
    "surface",
    "tied",
    "tube",
    "wall",
    "with_corners",
    *integrators.INTEGRATORS,
    *laws.LAWS,
    *solvers.SOLVERS,
    *(name for name in strategies.STRATEGIES if name not in ("NSCD", "Carpenter", "GranularElement", "SmoothDEM")),
]
names.teach(globals(), (name for name in __all__ if name not in _LATER))
for _space in (pre, pre.masonry):
    names.teach(vars(_space), _space.__all__)
names.teach(vars(pre.mesh), pre.mesh.__all__)
for _space in (pre.grains, pre.mass_properties):
    names.teach(vars(_space))
