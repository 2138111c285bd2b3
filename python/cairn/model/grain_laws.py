"""Laws of elastic grains by the words of other codes, and laws between unlike materials."""

from __future__ import annotations

import math

from ..base import checks
from ..names import one_of
from .laws import LAWS, Law

NORMAL = ("hooke", "hertz", "dmt", "jkr")
DAMPING = ("restitution", "tsuji", "velocity", "mass_velocity", "viscoelastic")
TANGENTIAL = ("no_history", "linear", "mindlin", "mindlin_rescale")
ROLLING = (None, "constant_torque", "spring_dashpot")


def granular(
    normal="hertz", *, young=None, poisson=0.3, stiffness=None, work=0.0, restitution=1.0, damping=None, coefficient=None,
    tangential=None, ratio=None, mu=0.0, tangential_damping=None, rolling=None, rolling_mu=0.0, rolling_ratio=2.25,
    rolling_damping=0.0, twisting=None, limit_damping=False,
):  # fmt: skip
    """Makes a law of elastic grains from its parts, by the words that LAMMPS's `granular` has for them.

    Parameters
    ----------
    normal : {"hooke", "hertz", "dmt", "jkr"}
        Normal force: a linear spring; Hertz (1881); with the pull 2 pi work R of Derjaguin, Muller & Toporov (1975) while the
        bodies touch; Johnson, Kendall & Roberts (1971).
    young, poisson : float
        Moduli of two like bodies [Pa, -]; see `mix` for unlike ones.
    stiffness : float, optional
        Of the linear spring of "hooke" [N/m].
    work : float
        Work of adhesion [J/m2], twice the surface energy.
    restitution : float
        Of a collision of two bodies, for damping "restitution" and "tsuji" [-].
    damping : {"restitution", "tsuji", "velocity", "mass_velocity", "viscoelastic"}, optional
        Dashpot: exact for the restitution (LAMMPS's coeff_restitution); by the polynomial of Tsuji, Tanaka & Ishida (1992) with
        the effective mass, which lets more rebound than it is asked for; by a coefficient [N s/m], one times the
        effective mass [1/s], or that times the contact radius [1/(m s)]. Not given: "restitution".
    coefficient : float, optional
        That of the last three.
    tangential : {"no_history", "linear", "mindlin", "mindlin_rescale"}, optional
        A dashpot alone, a linear spring, Mindlin's, or Mindlin's that gets shorter as the contact shrinks. Not given: "linear"
        for "hooke", else "mindlin".
    ratio : float, optional
        Tangential over normal stiffness of "hooke", 2/7 unless given; of a "linear" spring beside another normal force, its
        stiffness over Mindlin's, 1 unless given.
    mu : float
        Coulomb's friction [-]; under adhesion the limit is mu (f_n + 2 pull-off forces) (Thornton & Yin 1991).
    tangential_damping : float, optional
        Tangential over normal dashpot; not given: the same share of the critical damping.
    rolling : {None, "constant_torque", "spring_dashpot"}
        Resistance to rolling, models A and C of Ai, Chen, Rotter & Ooi (2011), up to rolling_mu R f_n, R the effective radius.
    rolling_mu, rolling_ratio, rolling_damping : float
        Its coefficient [-]; stiffness of the spring over f_n' (rolling_mu R)^2, 2.25 in 3D and 3 in 2D; share of the critical
        damping of a sphere on a wall [-].
    twisting : float or "marshall", optional
        Largest moment about the normal over R f_n [-], or 2/3 mu a f_n (Marshall 2009), a the contact radius.
    limit_damping : bool
        The dashpot never pulls as bodies part; of adhesive contacts, never by more than adhesion does: the force is at least that
        of the contact without the dashpot, or zero if that presses.

    Returns
    -------
    GranularContact
        For SmoothDEM.

    Raises
    ------
    ValueError
        If a word is unknown, or a number is missing or belongs to another choice.

    Examples
    --------
    >>> law = cn.granular("hertz", young=1e7, restitution=0.5, mu=0.4, rolling="spring_dashpot", rolling_mu=0.1)
    >>> law.rolling
    0.1
    """
    one_of("normal", normal, NORMAL)
    spring = normal == "hooke"
    if spring and (stiffness is None or young is not None):
        raise ValueError("normal is 'hooke', a linear spring: give stiffness [N/m], and no young")
    if not spring and (young is None or stiffness is not None):
        raise ValueError(f"normal is {normal!r}: give young [Pa], and no stiffness")
    damping = "restitution" if damping is None else damping
    one_of("damping", damping, DAMPING)
    by_coefficient = DAMPING.index(damping) >= 2
    if by_coefficient != (coefficient is not None):
        raise ValueError(
            f"damping is {damping!r}: give {'its coefficient' if by_coefficient else 'restitution, and no coefficient'}"
        )
    if damping in ("restitution", "tsuji") and not 0 <= checks.number("restitution", restitution) <= 1:
        raise ValueError(f"restitution is {restitution}: give a share of the speed between 0 and 1")
    tangential = ("linear" if spring else "mindlin") if tangential is None else tangential
    one_of("tangential", tangential, TANGENTIAL)
    if spring and tangential.startswith("mindlin"):
        raise ValueError(f"tangential is {tangential!r}, and 'hooke' has no moduli: give 'linear' or 'no_history'")
    if rolling not in ROLLING:
        raise ValueError(f"rolling is {rolling!r}: give 'constant_torque', 'spring_dashpot' or None")
    asked = {"rolling_mu": rolling_mu, "rolling_damping": rolling_damping}
    if rolling is None and any(checks.number(name, value) != 0 for name, value in asked.items()):
        raise ValueError(
            "rolling_mu or rolling_damping is given, and rolling is None: give rolling='constant_torque' or 'spring_dashpot'"
        )
    if rolling is not None and not checks.number("rolling_mu", rolling_mu) > 0:
        raise ValueError(f"rolling is {rolling!r}: give its coefficient rolling_mu > 0 [-]")
    marshall = isinstance(twisting, str)
    if marshall:
        one_of("twisting", twisting, ("marshall",))
    return LAWS["GranularContact"](
        model=NORMAL.index(normal),
        young=stiffness if spring else young,
        poisson=poisson,
        work=work,
        dashpot=DAMPING.index(damping),
        damping=coefficient if by_coefficient else restitution,
        slip=TANGENTIAL.index(tangential),
        ratio=(2 / 7 if spring else 1.0) if ratio is None else ratio,
        mu=mu,
        slip_damping=-1.0 if tangential_damping is None else tangential_damping,
        roll=ROLLING.index(rolling),
        rolling=rolling_mu,
        rolling_ratio=rolling_ratio,
        rolling_damping=rolling_damping,
        twist=0 if twisting is None else 2 if marshall else 1,
        twisting=0.0 if twisting is None or marshall else twisting,
        limited=int(checks.flag("limit_damping", limit_damping)),
    )


def mix(one, other, **given):
    """Makes the law between two materials from the laws that each has with its like.

    Young's modulus and Poisson's ratio are those of two like bodies with the effective moduli of the unlike ones, 1/E* =
    (1 - nu1^2)/E1 + (1 - nu2^2)/E2 and 1/G* = (2 - nu1)/G1 + (2 - nu2)/G2 (Mindlin 1949; Johnson 1985). Stiffnesses of springs
    are in series. Restitution, friction and all else are geometric means.

    Parameters
    ----------
    one, other : Law
        Of the same class, which has no curves of temperature.
    **given : float
        Parameters of the pair that are known, by name.

    Returns
    -------
    Law
        Of that class.

    Raises
    ------
    ValueError
        If the classes differ, or a choice between models does.

    Examples
    --------
    >>> steel, glass = cn.HertzMindlin(young=2e11, poisson=0.3), cn.HertzMindlin(young=6e10, poisson=0.24)
    >>> round(cn.mix(steel, glass, mu=0.3).young / 1e10, 2)
    9.23
    """
    if type(one) is not type(other) or not isinstance(one, Law):
        raise ValueError(f"laws are {one!r} and {other!r}: give two of the same class")
    if one.of_temperature or other.of_temperature:
        raise ValueError(f"{type(one).__name__} has parameters that depend on temperature: give the law of the pair itself")
    own = {name: (a, b) for name, a, b in zip(one.parameter_names, one.values, other.values)}
    mixed = {name: _mean(name, a, b) for name, (a, b) in own.items()}
    spring = own.get("model", (1, 1))[0] == 0  # GranularContact's young is then a stiffness
    if "young" in own and spring:
        mixed["young"] = _in_series(*own["young"])
    elif "young" in own:
        mixed["young"], mixed["poisson"] = _moduli(*own["young"], *own["poisson"])
    unknown = [name for name in given if name not in own]
    if unknown:
        raise ValueError(f"{type(one).__name__} has no parameter {unknown[0]!r}: it has {', '.join(own)}")
    return type(one)(**{**mixed, **given})


def interact_by_mixing(scene, laws, pairs=None):
    """Gives a scene the laws between all materials of a table: those on its diagonal as they are, others by `mix`.

    Parameters
    ----------
    scene : Scene
        It gets a rule for each pair.
    laws : dict
        Law of each material (or its name) with its like, all of one class.
    pairs : dict, optional
        (material, material): a law that overrides, or a dict of the parameters that `mix` is given.

    Raises
    ------
    ValueError
        If a pair names a material that the table does not have, or laws cannot be mixed.

    Examples
    --------
    >>> steel, glass = cn.Material("steel", density=7800.0), cn.Material("glass", density=2500.0)
    >>> table = {steel: cn.HertzMindlin(young=2e11), glass: cn.HertzMindlin(young=6e10)}
    >>> cn.interact_by_mixing(cn.Scene(3), table, pairs={(steel, glass): {"mu": 0.2}})
    """
    known = {frozenset(key): law for key, law in (pairs or {}).items()}
    for key in known:
        for material in key:
            if material not in laws:
                raise ValueError(f"pairs: {material!r} is not among the materials of laws")
    names = list(laws)
    for i, a in enumerate(names):
        for b in names[i:]:
            law = known.get(frozenset((a, b)), {})
            if not isinstance(law, Law):
                law = mix(laws[a], laws[b], **law)
            scene.interact(a, b, law)


CHOICES = ("model", "dashpot", "slip", "roll", "twist", "limited", "fit", "slip_damping")


def _mean(name, a, b):
    if name in CHOICES and a != b:
        raise ValueError(f"{name} of the laws is {a:g} and {b:g}: only laws of the same choices can be mixed")
    if a == b:
        return a
    if name in ("stiffness", "loading", "unloading", "normal_stiffness", "tangential_stiffness"):
        return _in_series(a, b)
    if name == "poisson":  # without Young's modulus beside it
        return (a + b) / 2
    return math.sqrt(a) * math.sqrt(b)


def _in_series(a, b):
    return 0.0 if a == 0 or b == 0 else 2 / (1 / a + 1 / b)


def _moduli(e1, e2, nu1, nu2):
    """Moduli of two like bodies with the effective ones of two unlike bodies."""
    if (e1, nu1) == (e2, nu2) or e1 == 0 or e2 == 0:
        return (e1 if (e1, nu1) == (e2, nu2) else 0.0), (nu1 + nu2) / 2
    plane = 1 / ((1 - nu1**2) / e1 + (1 - nu2**2) / e2)
    shear = 1 / (2 * (2 - nu1) * (1 + nu1) / e1 + 2 * (2 - nu2) * (1 + nu2) / e2)
    nu = (1 - 4 * shear / plane) / (1 - 2 * shear / plane)
    return 2 * plane * (1 - nu**2), nu
