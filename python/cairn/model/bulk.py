"""Materials of solids, one class for each row of the kernels' list (core_f90/bulk_materials):
`NeoHookean(young=1e6, poisson=0.3)`, `J2Plasticity(young=2e11, poisson=0.3, yield_stress=2.5e8, isotropic=1e10)`, ...
"""

from __future__ import annotations

import math

from .. import _core
from ..base import checks
from ..names import by_name, listed, parameters_section


class BulkMaterial:
    """Base of materials of solids: parameters in the order of the core's list.

    `name` is that of the kernel; `takes_gradient` tells that the material is for large strains alone.

    Parameters
    ----------
    values : sequence of float
        Parameters in the order of `parameter_names`.
    """

    name: str
    takes_gradient = False
    state: tuple[str, ...] = ()
    parameter_names: tuple[str, ...] = ()

    def __init__(self, values):
        self.values = tuple(values)

    def __repr__(self):
        words = ", ".join(f"{n}={v:g}" for n, v in zip(self.parameter_names, self.values))
        return f"{type(self).__name__}({words})"

    def __eq__(self, other):
        return type(self) is type(other) and self.values == other.values

    def __hash__(self):
        return hash((type(self).__name__, self.values))


# texts for help() on materials whose parameters need more than their names
SAID = {
    "ogden": """W = sum over k of shear_k/power_k (l1^power_k + l2^power_k + l3^power_k - 3) + bulk/2 (J - 1)^2, of the stretches
without change of volume l_i = J^(-1/3) lambda_i (Ogden 1972). The shear modulus at rest is the sum of shear_k power_k / 2, and
positive. Mooney and Rivlin's W = C10 (I1 - 3) + C01 (I2 - 3) is shear1=2 C10, power1=2, shear2=-2 C01, power2=-2; neo-Hookean
rubber the first term alone, shear1 its shear modulus.""",
    "drucker_prager": """sqrt(J2) + eta p <= xi c, of the mean stress p (tension positive) and the cohesion c = cohesion
+ hardening times the accumulated plastic strain. The cone goes through the edges of compression of Mohr and Coulomb's, outside:
eta = 6 sin(phi)/(sqrt(3) (3 - sin(phi))), xi = 6 cos(phi)/(sqrt(3) (3 - sin(phi))), so that strengths of triaxial compression
are Mohr and Coulomb's, and those in plane strain above (by 37 % in shear at phi = 0.5). For theirs in plane strain take
eta = sin(phi), xi = cos(phi) without dilation, or eta = 3 tan(phi)/sqrt(9 + 12 tan(phi)^2), xi = 3/sqrt(9 + 12 tan(phi)^2) with
dilation_angle = friction_angle, and give friction_angle = f with sin(f) = 3 sqrt(3) eta/(6 + sqrt(3) eta), and
cohesion = c xi sqrt(3) (3 - sin(f))/(6 cos(f)).""",
    "isotropic_damage": """Stress (1 - d) C strain, d of the largest norm of the positive principal strains so far. Softening
takes fracture_energy [J/m2] of a crack through cells that are `length` wide across it. At 0 that is the root of a cell's area
in 2D, the cube root of its volume in 3D, of triangles and tetrahedra the side of the square or cube that two or six of them
fill: right for squares and cubes; cells half as wide across the crack as along it take 0.71 of fracture_energy in 2D, 0.63 in
3D if they are flat. Give the width across the crack as `length` there. Cells of second order have one damage each, by the mean
square over their points.""",
}


def _stiff_in_shear(ogden):
    modulus = sum(ogden[f"shear{k}"] * ogden[f"power{k}"] for k in (1, 2, 3)) / 2
    if not modulus > 0:
        raise ValueError(
            f"the shear modulus of Ogden at rest is {modulus:g} Pa, the sum of shear_k power_k / 2: give terms whose sum is "
            "positive (a negative power goes with a negative shear)"
        )


CHECKED = {"ogden": _stiff_in_shear}  # conditions on several parameters together, beyond the range of each


def _material_class(description):
    parameters = description["parameters"]
    names = tuple(p[0] for p in parameters)

    def __init__(self, **given):
        own = type(self).__name__
        unknown = sorted(set(given) - set(names))
        if unknown:
            raise TypeError(f"{own} has no parameter {unknown[0]!r}; it has {listed(names, unknown[0])}")
        values = []
        for name, default, low, high in parameters:
            value = given.get(name, default)
            if value is None:
                raise TypeError(f"{own} needs {name}, from {low:.12g} to {high:.12g}")
            value = checks.number(f"{name} of {own}", value, finite=False)
            if math.isnan(value) or not low <= value <= high:
                raise ValueError(f"{name} of {own} is {value:g}: give a value from {low:.12g} to {high:.12g}")
            values.append(value)
        if description["name"] in CHECKED:
            CHECKED[description["name"]](dict(zip(names, values)))
        BulkMaterial.__init__(self, values)

    rows = [
        (name, "float" if default is None else f"float, default {default:g}", f"from {low:.12g} to {high:.12g}")
        for name, default, low, high in parameters
    ]
    said = ["", SAID[description["name"]]] if description["name"] in SAID else []
    doc = [f"Material of solids: {description['name'].replace('_', ' ')}.", *said, *parameters_section(rows)]
    members = {
        "name": description["name"],
        "takes_gradient": description["takes_gradient"],
        "state": tuple(description["state"]),
        "parameter_names": names,
        "__init__": __init__,
        "__signature__": by_name(parameters),
        "__doc__": "\n".join(doc),
    }
    return type(description["python_name"], (BulkMaterial,), members)


BULK_MATERIALS = {d["python_name"]: _material_class(d) for d in _core.bulk_materials()}
globals().update(BULK_MATERIALS)
__all__ = ["BulkMaterial", *BULK_MATERIALS]


class Umat(BulkMaterial):
    """A user's routine UMAT with its PROPS, after cairn.plug(library, material="umat").

    Parameters
    ----------
    name : str
        Name of the material.
    props : sequence of float
        PROPS of the routine.
    state : sequence of str
        Names of its state variables.
    """

    def __init__(self, name, props, state):
        super().__init__(checks.number(f"PROPS({k + 1}) of {name}", p) for k, p in enumerate(props))
        self.name, self.state = name, tuple(state)
        self.parameter_names = tuple(f"props{k + 1}" for k in range(len(self.values)))


def plugged_material(library, symbol, name, states, plane_stress, time_limit):
    """Registers a UMAT of a library.

    Parameters
    ----------
    library : path-like
        Path of the shared library.
    symbol : str
        Name of the routine in it.
    name : str
        Name of the material.
    states : int
        Number of state variables, NSTATV.
    plane_stress : bool
        True for a routine written for elements of plane stress.
    time_limit : float
        Limit of a call [s] if the routine runs in a process of its own; 0: it runs in this process.

    Returns
    -------
    callable
        Function of the PROPS that makes the material, a Umat.
    """
    _core.plug_umat(str(library), symbol, name, int(states), plane_stress, time_limit)
    state = next(d["state"] for d in _core.bulk_materials() if d["name"] == name)
    return lambda *props: Umat(name, props, state)
