# written by script/stubs.py from the lists of the core: change those, and run it

from typing import Any

from . import _core as _core
from . import base as base
from . import files as files
from . import legacy as legacy
from . import model as model
from . import names as names
from . import networks as networks
from . import options as options
from . import plugs as plugs
from . import post as post
from . import pre as pre
from . import problems as problems
from . import run as run
from . import study as study
from ._core import Error as Error
from .base.errors import FileError as FileError
from .base.materials import Material as Material
from .base.time_functions import Expression as Expression
from .base.time_functions import Harmonic as Harmonic
from .base.time_functions import Servo as Servo
from .base.time_functions import Table as Table
from .model import fracture as fracture
from .model import laws as laws
from .model.bodies import BodySet as BodySet
from .model.bodies import ContactorSet as ContactorSet
from .model.bodies import clumps as clumps
from .model.bodies import disks as disks
from .model.bodies import spheres as spheres
from .model.boundaries import box as box
from .model.boundaries import ring as ring
from .model.boundaries import segment as segment
from .model.boundaries import tube as tube
from .model.boundaries import wall as wall
from .model.bulk import BulkMaterial
from .model.callbacks import BodyStep as BodyStep
from .model.callbacks import CallbackBody as CallbackBody
from .model.elastic import ElasticBody as ElasticBody
from .model.fluid_ends import Inflow as Inflow
from .model.fluid_ends import Outflow as Outflow
from .model.fluids import FreeSlip as FreeSlip
from .model.fluids import GrainDrag as GrainDrag
from .model.fluids import NoSlip as NoSlip
from .model.fluids import fluid as fluid
from .model.frames import bars as bars
from .model.frames import beams as beams
from .model.grain_laws import granular as granular
from .model.grain_laws import interact_by_mixing as interact_by_mixing
from .model.grain_laws import mix as mix
from .model.joints import Ball as Ball
from .model.joints import Cable as Cable
from .model.joints import Distance as Distance
from .model.joints import Fixed as Fixed
from .model.joints import Hinge as Hinge
from .model.joints import Motor as Motor
from .model.joints import Pivot as Pivot
from .model.joints import Slider as Slider
from .model.joints import Spring as Spring
from .model.laws import Law as Law
from .model.meshes import LinearBody as LinearBody
from .model.meshes import deformable as deformable
from .model.missing_laws import MissingLawWarning as MissingLawWarning
from .model.periodic import Periodic as Periodic
from .model.round_shapes import capsules as capsules
from .model.round_shapes import cylinders as cylinders
from .model.round_shapes import superquadrics as superquadrics
from .model.scene import Scene as Scene
from .model.shapes import boxes as boxes
from .model.shapes import polygons as polygons
from .model.shapes import polyhedra as polyhedra
from .model.shapes import with_corners as with_corners
from .model.solid import SolidBody as SolidBody
from .model.surfaces import surface as surface
from .model.ties import tied as tied
from .options import integrators as integrators
from .options import solvers as solvers
from .options import strategies as strategies
from .options.integrators import Integrator
from .options.solvers import ContactSolver, ProblemSolver
from .options.strategies import NSCD as NSCD
from .options.strategies import Carpenter as Carpenter
from .options.strategies import GranularElement as GranularElement
from .options.strategies import SmoothDEM as SmoothDEM
from .options.strategies import Strategy
from .options.strategies import strategy as strategy
from .plugs.plug import plug as plug
from .post.load import load as load
from .post.series import open_series as open_series
from .run import precice as precice
from .run import soe as soe
from .run.equilibrium import find_equilibrium as find_equilibrium
from .run.probes import Probe as Probe
from .run.scene_warnings import SceneWarning as SceneWarning
from .run.simulation import Simulation as Simulation
from .run.step_warnings import EnergyCreatedWarning as EnergyCreatedWarning
from .run.step_warnings import JointWarning as JointWarning
from .run.step_warnings import OverlapWarning as OverlapWarning
from .run.step_warnings import RunawayWarning as RunawayWarning
from .run.step_warnings import StableStepWarning as StableStepWarning
from .run.step_warnings import TunnellingWarning as TunnellingWarning
from .run.step_warnings import TurnedWarning as TurnedWarning
from .run.step_warnings import UnjoinedWarning as UnjoinedWarning
from .run.unit_warnings import UnitsWarning as UnitsWarning
from .run.unmet_shapes import ShapesWarning as ShapesWarning

class Coulomb(Law):
    def __init__(self, *, mu: float) -> None: ...

class Restitution(Law):
    def __init__(self, *, mu: float = 0.0, normal: float = 0.0, tangential: float = 0.0, closing: float = 1.0) -> None: ...

class Frictionless(Law):
    def __init__(self) -> None: ...

class Bonded(Law):
    def __init__(self, *, mu: float = 0.0) -> None: ...

class GapCoulomb(Law):
    def __init__(self, *, mu: float) -> None: ...

class LinearSpring(Law):
    def __init__(
        self, *, stiffness: float, ratio: float = 0.2857142857142857, restitution: float = 1.0, mu: float = 0.0
    ) -> None: ...

class HertzMindlin(Law):
    def __init__(self, *, young: float, poisson: float = 0.3, restitution: float = 1.0, mu: float = 0.0) -> None: ...

class JKR(Law):
    def __init__(self, *, young: float, work: float, poisson: float = 0.3, restitution: float = 1.0, mu: float = 0.0) -> None: ...

class MAC(Law):
    def __init__(
        self,
        *,
        normal_stiffness: float,
        tangential_stiffness: float,
        mu: float = 0.0,
        power: float = 1.0,
        recovery: float = 0.0,
        within: float = 0.0,
        work: float,
        viscosity: float = 0.0,
        pressure: float = 0.0,
        pressure_power: float = 1.0,
        kinetic: float = ...,
    ) -> None: ...

class MP(Law):
    def __init__(
        self,
        *,
        normal_stiffness: float,
        tangential_stiffness: float,
        mu: float = 0.0,
        power: float = 1.0,
        recovery: float = 0.0,
        within: float = 0.0,
        work: float,
        pressure: float = 0.0,
        pressure_power: float = 1.0,
        kinetic: float = ...,
    ) -> None: ...

class MP3(Law):
    def __init__(
        self,
        *,
        normal_stiffness: float,
        tangential_stiffness: float,
        mu: float = 0.0,
        power: float = 1.0,
        recovery: float = 0.0,
        within: float = 0.0,
        strength: float,
        work: float,
        pressure: float = 0.0,
        pressure_power: float = 1.0,
        kinetic: float = ...,
    ) -> None: ...

class MAL(Law):
    def __init__(
        self,
        *,
        normal_stiffness: float,
        tangential_stiffness: float,
        mu: float = 0.0,
        power: float = 1.0,
        recovery: float = 0.0,
        within: float = 0.0,
        normal_strength: float,
        tangential_strength: float,
        normal_work: float,
        tangential_work: float,
        pressure: float = 0.0,
        pressure_power: float = 1.0,
        kinetic: float = ...,
    ) -> None: ...

class TH(Law):
    def __init__(
        self,
        *,
        normal_stiffness: float,
        tangential_stiffness: float,
        mu: float = 0.0,
        power: float = 1.0,
        recovery: float = 0.0,
        within: float = 0.0,
        normal_strength: float,
        tangential_strength: float,
        normal_work: float,
        tangential_work: float,
        normal_plateau: float = 0.0,
        tangential_plateau: float = 0.0,
        pressure: float = 0.0,
        pressure_power: float = 1.0,
        kinetic: float = ...,
    ) -> None: ...

class ABP(Law):
    def __init__(
        self,
        *,
        normal_stiffness: float,
        tangential_stiffness: float,
        mu: float = 0.0,
        power: float = 1.0,
        recovery: float = 0.0,
        within: float = 0.0,
        normal_strength: float,
        tangential_strength: float,
        normal_work: float,
        tangential_work: float,
        normal_end: float,
        tangential_end: float,
        first_share: float,
        pressure: float = 0.0,
        pressure_power: float = 1.0,
        kinetic: float = ...,
    ) -> None: ...

class EXPO(Law):
    def __init__(
        self,
        *,
        normal_stiffness: float,
        tangential_stiffness: float,
        mu: float = 0.0,
        power: float = 1.0,
        recovery: float = 0.0,
        within: float = 0.0,
        normal_strength: float,
        tangential_strength: float,
        normal_work: float,
        tangential_work: float,
        rest: float = 0.001,
        pressure: float = 0.0,
        pressure_power: float = 1.0,
        kinetic: float = ...,
    ) -> None: ...

class MohrCoulomb(Law):
    def __init__(
        self,
        *,
        tension: float,
        cohesion: float,
        friction: float = 0.0,
        mu: float = 0.0,
        cap: float = ...,
        within: float = 0.0,
        kinetic: float = ...,
    ) -> None: ...

class Sintering(Law):
    def __init__(
        self,
        *,
        tension: float,
        cohesion: float,
        friction: float = 0.0,
        mu: float = 0.0,
        cap: float = ...,
        pressure: float = 0.0,
        dose: float = 0.0,
    ) -> None: ...

class ParallelBond(Law):
    def __init__(
        self,
        *,
        normal_stiffness: float,
        tangential_stiffness: float,
        tension: float = ...,
        shear: float = ...,
        mu: float = 0.0,
        radius: float = 0.5,
        within: float = 0.0,
    ) -> None: ...

class Rod(Law):
    def __init__(
        self,
        *,
        stiffness: float = ...,
        prestrain: float = 0.0,
        viscosity: float = 0.0,
        strength: float = ...,
        mu: float = 0.0,
        within: float,
    ) -> None: ...

class Wire(Law):
    def __init__(
        self,
        *,
        stiffness: float = ...,
        prestrain: float = 0.0,
        viscosity: float = 0.0,
        strength: float = ...,
        mu: float = 0.0,
        within: float,
    ) -> None: ...

class Wet(Law):
    def __init__(self, *, force: float, reach: float, mu: float = 0.0) -> None: ...

class Capillary(Law):
    def __init__(self, *, tension: float, volume: float, angle: float = 0.0, mu: float = 0.0) -> None: ...

class Rolling(Law):
    def __init__(self, *, mu: float, rolling: float = 0.0, twisting: float = 0.0) -> None: ...

class RollingWet(Law):
    def __init__(self, *, force: float, reach: float, mu: float = 0.0, rolling: float = 0.0, twisting: float = 0.0) -> None: ...

class RollingBonded(Law):
    def __init__(self, *, mu: float, rolling: float = 0.0, twisting: float = 0.0) -> None: ...

class RollingCapillary(Law):
    def __init__(
        self, *, tension: float, volume: float, angle: float = 0.0, mu: float = 0.0, rolling: float = 0.0, twisting: float = 0.0
    ) -> None: ...

class Wear(Law):
    def __init__(self, *, mu: float, wear: float, recovers: float = 0.0) -> None: ...

class UnilateralContact(Law):
    def __init__(
        self,
        *,
        mu: float,
        kinetic: float = ...,
        shift: float = 0.0,
        from_start: float = 0.0,
        recovers: float = 0.0,
        normal: float = 0.0,
        tangential: float = 0.0,
        closing: float = 1.0,
        within: float = 0.0,
    ) -> None: ...

class ElasticContact(Law):
    def __init__(
        self,
        *,
        stiffness: float,
        viscosity: float = 0.0,
        mu: float = 0.0,
        kinetic: float = ...,
        closing: float = 1.0,
        from_start: float = 0.0,
        within: float = 0.0,
    ) -> None: ...

class AdhesiveContact(Law):
    def __init__(
        self,
        *,
        force: float,
        reach: float,
        mu: float = 0.0,
        kinetic: float = ...,
        torn_force: float = ...,
        once: float = 0.0,
        stiffness: float = ...,
        viscosity: float = 0.0,
        recovers: float = 0.0,
        normal: float = 0.0,
        tangential: float = 0.0,
        closing: float = 1.0,
        within: float = 0.0,
        touching: float = 1.0,
    ) -> None: ...

class GapRescue(Law):
    def __init__(self, *, mu: float, period: float = 8.885765876316732, tolerance: float = 0.0) -> None: ...

class CoupledMotion(Law):
    def __init__(
        self, *, normal: float = 1.0, tangential: float = 1.0, reach: float, impulse: float = ..., breaks: float = 0.0
    ) -> None: ...

class LimitedSlip(Law):
    def __init__(self, *, mu: float, limit: float, recovers: float = 0.0) -> None: ...

class BrittleCoating(Law):
    def __init__(self, *, mu: float = 0.0, stiffness: float, strength: float, rest: float = 0.0, reach: float) -> None: ...

class MACContact(Law):
    def __init__(
        self,
        *,
        normal_stiffness: float,
        tangential_stiffness: float,
        mu: float = 0.0,
        power: float = 1.0,
        recovery: float = 0.0,
        within: float = 0.0,
        work: float,
        viscosity: float = 0.0,
        force: float = 0.0,
        reach: float = 0.0,
        stiffness: float = ...,
        limit: float = ...,
        loss: float = 0.0,
        pressure: float = 0.0,
        pressure_power: float = 1.0,
        kinetic: float = ...,
    ) -> None: ...

class PlasticEXPO(Law):
    def __init__(
        self,
        *,
        normal_stiffness: float,
        tangential_stiffness: float,
        mu: float = 0.0,
        power: float = 1.0,
        recovery: float = 0.0,
        within: float = 0.0,
        normal_strength: float,
        tangential_strength: float,
        normal_work: float,
        tangential_work: float,
        rest: float = 0.001,
        damage_share: float = 1.0,
        normal_spring: float = ...,
        tangential_spring: float = ...,
        pressure: float = 0.0,
        pressure_power: float = 1.0,
        kinetic: float = ...,
    ) -> None: ...

class CompositeInterface(Law):
    def __init__(
        self,
        *,
        normal_stiffness: float,
        tangential_stiffness: float,
        tension: float,
        cohesion: float,
        normal_work: float,
        tangential_work: float,
        friction: float,
        mu: float,
        cap: float = ...,
        cap_work: float = ...,
        cap_shear: float = 9.0,
        peak: float = 0.0,
        dilatancy: float = 0.0,
        closes: float = 1.0,
        within: float = 0.0,
    ) -> None: ...

class CriticalVoigt(Law):
    def __init__(self, *, mu: float, period: float = 1.0, damping: float = 1.0, ratio: float = 1.0) -> None: ...

class AdhesiveSpring(Law):
    def __init__(
        self, *, stiffness: float, adhesion: float = 0.0, damping: float = 0.0, viscosity: float = 0.0, mu: float = 0.0
    ) -> None: ...

class GranularContact(Law):
    def __init__(
        self,
        *,
        model: float = 1.0,
        young: float,
        poisson: float = 0.3,
        work: float = 0.0,
        dashpot: float = 0.0,
        damping: float = 1.0,
        slip: float = 2.0,
        ratio: float = 0.2857142857142857,
        mu: float = 0.0,
        roll: float = 0.0,
        rolling: float = 0.0,
        rolling_ratio: float = 2.25,
        rolling_damping: float = 0.0,
        twist: float = 0.0,
        twisting: float = 0.0,
        limited: float = 0.0,
        slip_damping: float = -1.0,
    ) -> None: ...

class SmoothBond(Law):
    def __init__(
        self,
        *,
        normal_stiffness: float,
        tangential_stiffness: float,
        tension: float = ...,
        shear: float = ...,
        mu: float = 0.0,
        radius: float = 0.5,
        within: float = 0.0,
        damping: float = 0.0,
    ) -> None: ...

class LiquidBridge(Law):
    def __init__(
        self,
        *,
        young: float,
        tension: float,
        volume: float,
        angle: float = 0.0,
        fit: float = 0.0,
        poisson: float = 0.3,
        restitution: float = 1.0,
        mu: float = 0.0,
    ) -> None: ...

class PlasticContact(Law):
    def __init__(
        self,
        *,
        loading: float,
        unloading: float,
        cohesion: float = 0.0,
        plastic: float = 0.05,
        damping: float = 0.0,
        ratio: float = 0.2857142857142857,
        mu: float = 0.0,
    ) -> None: ...

class YieldContact(Law):
    def __init__(
        self, *, young: float, yield_pressure: float, poisson: float = 0.3, restitution: float = 1.0, mu: float = 0.0
    ) -> None: ...

class Joint(Law):
    def __init__(
        self,
        *,
        blocked: float,
        coordinate: float = 0.0,
        axis_x: float = 1.0,
        axis_y: float = 0.0,
        axis_z: float = 0.0,
        lowest: float = ...,
        highest: float = ...,
        speed: float = 0.0,
        effort: float = 0.0,
        strength: float = ...,
        spans: float = 0.0,
        stiffness: float = 0.0,
        damping: float = 0.0,
        rest: float = 0.0,
        pulley: float = 0.0,
        far: float = 0.0,
    ) -> None: ...

class IsotropicElastic(BulkMaterial):
    def __init__(self, *, young: float, poisson: float = 0.0) -> None: ...

class OrthotropicElastic(BulkMaterial):
    def __init__(
        self,
        *,
        young1: float,
        young2: float,
        young3: float,
        poisson12: float,
        poisson13: float,
        poisson23: float,
        shear12: float,
        shear23: float,
        shear13: float,
        angle: float = 0.0,
    ) -> None: ...

class KelvinVoigt(BulkMaterial):
    def __init__(self, *, young: float, poisson: float = 0.0, viscous_young: float, viscous_poisson: float = 0.0) -> None: ...

class SaintVenantKirchhoff(BulkMaterial):
    def __init__(self, *, young: float, poisson: float = 0.0) -> None: ...

class NeoHookean(BulkMaterial):
    def __init__(self, *, young: float, poisson: float = 0.0) -> None: ...

class Ogden(BulkMaterial):
    def __init__(
        self,
        *,
        bulk: float,
        shear1: float,
        power1: float,
        shear2: float = 0.0,
        power2: float = 2.0,
        shear3: float = 0.0,
        power3: float = 2.0,
    ) -> None: ...

class J2Plasticity(BulkMaterial):
    def __init__(
        self,
        *,
        young: float,
        poisson: float = 0.0,
        yield_stress: float,
        isotropic: float = 0.0,
        kinematic: float = 0.0,
        swift_strain: float = 1.0,
        swift_power: float = 0.0,
    ) -> None: ...

class FiniteJ2(BulkMaterial):
    def __init__(
        self,
        *,
        young: float,
        poisson: float = 0.0,
        yield_stress: float,
        isotropic: float = 0.0,
        kinematic: float = 0.0,
        swift_strain: float = 1.0,
        swift_power: float = 0.0,
    ) -> None: ...

class DruckerPrager(BulkMaterial):
    def __init__(
        self,
        *,
        young: float,
        poisson: float = 0.0,
        cohesion: float,
        friction_angle: float,
        dilation_angle: float = 0.0,
        hardening: float = 0.0,
    ) -> None: ...

class IsotropicDamage(BulkMaterial):
    def __init__(
        self, *, young: float, poisson: float = 0.0, strength: float, fracture_energy: float, length: float = 0.0
    ) -> None: ...

class Theta(Integrator):
    def __init__(self, *, theta: float = 0.5) -> None: ...

class Newmark(Integrator):
    def __init__(self, *, beta: float = 0.25, gamma: float = 0.5) -> None: ...

class HHT(Integrator):
    def __init__(self, *, alpha: float = -0.05) -> None: ...

class GeneralisedAlpha(Integrator):
    def __init__(self, *, spectral_radius: float = 0.8) -> None: ...

class CentralDifference(Integrator):
    def __init__(self) -> None: ...

class BetaScheme(Integrator):
    def __init__(self, *, beta: float = 0.5) -> None: ...

class VelocityVerlet(Integrator):
    def __init__(self) -> None: ...

class Gear(Integrator):
    def __init__(self, *, values: float = 5.0) -> None: ...

class DiscreteGradient(Integrator):
    def __init__(self) -> None: ...

class Default(ContactSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    def __init__(self, tol: float | None = None, min_iter: int = 1, max_iter: int = 1000) -> None: ...

class NLGS(ContactSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    acceleration: str
    associated_start: bool
    softening_relaxation: float
    enough: float | None
    patience: int
    def __init__(
        self,
        tol: float | None = 0.0001,
        min_iter: int = 1,
        max_iter: int = 1000,
        acceleration: str = "nesterov",
        associated_start: bool = False,
        softening_relaxation: float = 1.0,
        enough: float | None = None,
        patience: int = 0,
    ) -> None: ...

class Auto(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    enough: float | None
    patience: int
    def __init__(
        self,
        tol: float | None = 0.0001,
        min_iter: int = 1,
        max_iter: int = 1000,
        memory: float = 1000000000.0,
        enough: float | None = None,
        patience: int = 0,
    ) -> None: ...

class NewtonAlartCurnier(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class NewtonJeanMoreau(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class NewtonFischerBurmeister(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class PPANewton(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class ColouredNLGS(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class RandomNLGS(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class AndersonNLGS(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class NesterovNLGS(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class ADMM(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class ConjugateGradient(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class PreconditionedConjugateGradient(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class AcceleratedGradient(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class Extragradient(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class InteriorPoint(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class Lemke(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class Enumeration(ProblemSolver):
    tol: float | None
    min_iter: int
    max_iter: int
    memory: float
    def __init__(
        self, tol: float | None = 0.0001, min_iter: int = 1, max_iter: int = 1000, memory: float = 4000000000.0
    ) -> None: ...

class EventDriven(Strategy):
    def __init__(self, **options: Any) -> None: ...

__version__: str
__all__: list[str]
