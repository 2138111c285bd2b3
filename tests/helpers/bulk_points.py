"""Materials of solids at points, without cells: parameters, strains and the kernel of each row of bulk_materials.def."""

import numpy as np
from cairn import _core

ROWS = {d["name"]: d for d in _core.bulk_materials()}
GIVEN = {
    "isotropic_elastic": {"young": 3.0, "poisson": 0.3},
    "orthotropic_elastic": dict(
        young1=3.0, young2=2.0, young3=1.0, poisson12=0.3, poisson13=0.2, poisson23=0.25, shear12=0.8, shear23=0.5, shear13=0.7,
        angle=0.4,
    ),
    "kelvin_voigt": {"young": 3.0, "poisson": 0.3, "viscous_young": 0.7, "viscous_poisson": 0.1},
    "saint_venant_kirchhoff": {"young": 3.0, "poisson": 0.3},
    "neo_hookean": {"young": 3.0, "poisson": 0.3},
    "ogden": {"bulk": 4.0, "shear1": 1.2, "power1": 1.7, "shear2": -0.4, "power2": -2.0, "shear3": 0.1, "power3": 4.0},
    "j2_plasticity": dict(
        young=3.0, poisson=0.3, yield_stress=0.05, isotropic=0.1, kinematic=0.2, swift_strain=0.1, swift_power=0.4
    ),
    "finite_j2": dict(young=3.0, poisson=0.3, yield_stress=0.05, isotropic=0.1, swift_strain=0.1, swift_power=0.4),
    "drucker_prager": dict(young=3.0, poisson=0.3, cohesion=0.02, friction_angle=0.5, dilation_angle=0.2, hardening=0.1),
    "isotropic_damage": dict(young=3.0, poisson=0.3, strength=0.03, fracture_energy=0.005),
}  # fmt: skip


def params(name, **other):
    given = {**GIVEN[name], **other}
    return [given.get(p[0], p[1]) for p in ROWS[name]["parameters"]]


def found(name, measure, state=None, h=0.1, theta=0.6, length=1.0, values=None):
    """The kernel at points; gradients (n, 3, 3) are F - 1."""
    measure = np.asarray(measure, float)
    rows = measure.reshape(len(measure), -1)
    if ROWS[name]["takes_gradient"]:
        rows = np.swapaxes(measure, 1, 2).reshape(len(measure), 9)
    states = len(ROWS[name]["state"])
    begin = np.zeros((len(rows), states)) if state is None else np.asarray(state, float)
    return _core.bulk_points(name, values or params(name), np.ascontiguousarray(rows), begin, h, theta, length)


def ways(name, n=12):
    """Strains, or gradients of displacement, small and large, some of them equal in two directions."""
    rng = np.random.default_rng(5)
    if ROWS[name]["takes_gradient"]:
        some = 0.3 * (rng.random((n, 3, 3)) - 0.5)
        some[0] = np.diag([0.2, 0.2, -0.1])
        some[1] = np.diag([0.2, 0.2 + 1e-9, 0.2])
        return some
    some = 0.2 * (rng.random((n, 6)) - 0.5)
    some[0] = [0.1, 0.1, -0.05, 0, 0, 0]
    return some
