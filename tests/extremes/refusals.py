"""Input that is no number, or that no scene can be made of: the error names field, index, value and remedy."""

from __future__ import annotations

import re

import cairn as cn
import numpy as np
from scenes import Figure

NAN, INF = float("nan"), float("inf")
ROCK = cn.Material("rock", density=1000.0)


def refused(call, pattern):
    """Figures of a call that must raise ValueError, and say the words of the pattern."""
    try:
        with np.errstate(over="ignore", under="ignore"):  # a warning may come before the error, not instead of it
            call()
    except ValueError as error:
        said = bool(re.search(pattern, str(error), re.S))
        return [Figure("says" if said else f"says {str(error)[:80]!r}", float(said), 1.0, 1.0, 0.0)]
    return [Figure("was accepted", 0.0, 1.0, 1.0, 0.0)]


def disk(**options):
    return cn.disks([[0, 1]], 1.0, ROCK, **options)


def simulation(dt=1e-3, scene=None, **strategy):
    if scene is None:
        scene = cn.Scene(2, gravity=(0, -9.81))
        scene.add(disk(), cn.wall((0, 0), (0, 1), ROCK))
        scene.interact("*", "*", cn.Coulomb(mu=0.5))
    return cn.Simulation(scene, dt, cn.NSCD(**strategy) if strategy else None)


def moved(name, value):
    """A simulation told to go to a place, and the state it keeps when it refuses."""

    def call():
        sim = simulation()
        before = getattr(sim.bodies, name).copy()
        try:
            values = before.copy()
            values.flat[1] = value
            sim.bodies.set(**{name: values})
        finally:
            assert np.array_equal(before, getattr(sim.bodies, name)), "the state was changed"

    return call


def step_with(scene_of):
    """A step that cannot be made leaves the simulation where it was."""

    def call():
        sim = simulation(scene=scene_of())
        before = sim.bodies.position.copy(), sim.time
        try:
            sim.step()
        finally:
            assert np.array_equal(before[0], sim.bodies.position) and before[1] == sim.time, "half a step was left"

    return call


def scene_with(gravity=(0, -9.81), **options):
    def build():
        scene = cn.Scene(2, gravity=gravity)
        scene.add(disk(**options), cn.wall((0, 0), (0, 1), ROCK))
        scene.interact("*", "*", cn.Coulomb(mu=0.5))
        return scene

    return build


def two_laws_missing():
    scene = cn.Scene(2)
    scene.add(disk(), cn.wall((0, 0), (0, 1), ROCK))
    sim = cn.Simulation(scene, 1e-3)
    sim.step()


def clump(mass=1.0, inertia=1.0):
    return cn.clumps([[0, 0]], [[0, 0]], [1.0], mass, inertia, ROCK)


def added(make, dim=2):
    """Adds to a scene, which must be left as it was."""

    def call():
        scene = cn.Scene(dim)
        made = make()
        try:
            scene.add(made)
        finally:
            assert len(scene.sets) == 0, "something half-built stayed"

    return call


# name, call (made when the cell runs), words that the error must hold
REFUSALS = [
    ("radius nan", lambda: cn.disks([[0, 0], [3, 0]], [1.0, NAN], ROCK), r"radii\[1\] is nan.*give"),
    ("radius inf", lambda: cn.disks([[0, 0]], [INF], ROCK), r"radii\[0\] is inf.*give"),
    ("radius 0", lambda: cn.disks([[0, 0]], [0.0], ROCK), r"radii\[0\] is 0.*give"),
    ("radius -1", lambda: cn.spheres([[0, 0, 0]], -1.0, ROCK), r"radii is -1.*give"),
    ("centre nan", lambda: cn.disks([[0, 0], [0, NAN]], 1.0, ROCK), r"centers\[1, 1\] is nan.*give"),
    ("centres of text", lambda: cn.disks([["a", "b"]], 1.0, ROCK), r"centers.*real numbers.*give"),
    ("centres complex", lambda: cn.disks([[1j, 0]], 1.0, ROCK), r"centers.*real numbers.*give"),
    ("centres of 3 in 2D", lambda: cn.disks([[0, 0, 0]], 1.0, ROCK), r"centers has shape \(1, 3\).*give"),
    ("radii too few", lambda: cn.disks([[0, 0], [3, 0]], [1.0], ROCK), r"radii has 1 items.*give"),
    ("density nan", lambda: cn.Material("rock", density=NAN), r"density is nan.*give"),
    ("density 0", lambda: cn.Material("rock", density=0.0), r"density is 0.*give"),
    ("density missing", lambda: cn.disks([[0, 0]], 1.0, cn.Material("bare")), r"density.*bare.*missing"),
    (
        "density 1e308, mass beyond doubles",
        added(lambda: cn.disks([[0, 0]], 1e9, ROCK, density=1e300)),
        r"mass\[0\] is inf.*give",
    ),
    (
        "density 1e-320, mass below doubles",
        added(lambda: cn.disks([[0, 0]], 1e-9, ROCK, density=1e-320)),
        r"mass\[0\] is 0.*give",
    ),
    ("mass nan", added(lambda: clump(mass=NAN)), r"mass.*nan.*give"),
    ("mass 0", added(lambda: clump(mass=0.0)), r"mass.* 0.*give"),
    ("mass -1", added(lambda: clump(mass=-1.0)), r"mass.*-1.*give"),
    ("inertia nan", added(lambda: clump(inertia=NAN)), r"inertia.*nan.*give"),
    ("inertia 0", added(lambda: clump(inertia=0.0)), r"inertia.* 0.*give"),
    (
        "inertia no body can have",
        added(lambda: cn.clumps([[0, 0, 0]], [[0, 0, 0]], [1.0], 1.0, (1.0, 1.0, 3.0), ROCK), dim=3),
        r"inertia.*larger than the sum of the other two.*check",
    ),
    ("velocity nan", lambda: disk(velocity=(NAN, 0)), r"velocity\[0, 0\] is nan.*give"),
    ("force inf", lambda: disk(force=(0, INF)), r"force\[0, 1\] is inf.*give"),
    ("drive nan", lambda: disk(driven="vx", drive=(NAN, 0)), r"drive\[0, 0\] is nan.*give"),
    ("drive(t) nan", step_with(scene_with(driven="vx", drive=lambda t: (NAN if t > 0 else 0.0, 0))), r"drive.*nan.*give"),
    ("force(t) nan", step_with(scene_with(force=lambda t: (0, NAN if t > 0 else 0.0))), r"force.*nan.*give"),
    ("gravity(t) inf", step_with(scene_with(gravity=lambda t: (0, INF if t > 0 else 0.0))), r"gravity.*inf.*give"),
    ("force beyond doubles", step_with(scene_with(force=(0.0, 1e308), density=1e-10)), r"velocity.*body.*|not finite"),
    ("damping nan", lambda: disk(damping=NAN), r"damping\[0\] is nan.*give"),
    ("driven dof that is none", lambda: disk(driven="vz"), r"driven names 'vz'.*vx"),
    ("gravity nan", lambda: cn.Scene(2, gravity=(0, NAN)), r"gravity\[1\] is nan.*give"),
    ("origin inf", lambda: cn.Scene(2, origin=(INF, 0)), r"origin\[0\] is inf.*give"),
    ("dim 4", lambda: cn.Scene(4), r"dim is 4.*give"),
    ("depth 0", lambda: cn.Scene(2, depth=0.0), r"depth is 0.*give"),
    ("normal 0", lambda: cn.wall((0, 0), (0, 0), ROCK), r"normal is.*give"),
    ("normal nan", lambda: cn.wall((0, 0), (0, NAN), ROCK), r"normal\[1\] is nan.*give"),
    ("segment of no length", lambda: cn.segment((0, 0), (0, 0), ROCK), r"end is.*give"),
    ("segment radius nan", added(lambda: cn.segment((0, 0), (1, 0), ROCK, radius=NAN)), r"radius.*nan.*give"),
    ("tube radius 0", lambda: cn.tube((0, 0, 0), (0, 0, 1), 0.0, ROCK), r"radius is 0.*give"),
    ("tube half length nan", lambda: cn.tube((0, 0, 0), (0, 0, 1), 1.0, ROCK, half_length=NAN), r"half_length.*nan.*give"),
    ("periodic length nan", lambda: cn.Scene(2, periodic=cn.Periodic((NAN, 1.0))), r"length.*nan.*give"),
    ("periodic length -1", lambda: cn.Scene(2, periodic=cn.Periodic((-1.0, 1.0))), r"length.*-1.*give"),
    ("periodic lean nan", lambda: cn.Scene(2, periodic=cn.Periodic((1.0, 1.0), lean=NAN)), r"lean is nan.*give"),
    ("mu nan", lambda: cn.Coulomb(mu=NAN), r"mu of Coulomb is nan.*give"),
    ("mu -1", lambda: cn.Coulomb(mu=-1.0), r"mu of Coulomb is -1.*give"),
    ("restitution 1.5", lambda: cn.Restitution(normal=1.5), r"normal of Restitution is 1.5.*give"),
    ("no law for a pair", two_laws_missing, r"no law.*rock"),
    ("dt 0", lambda: simulation(dt=0.0), r"dt is 0.*give"),
    ("dt nan", lambda: simulation(dt=NAN), r"dt is nan.*give"),
    ("dt inf", lambda: simulation(dt=INF), r"dt is inf.*give"),
    ("dt 1e300, places beyond doubles", lambda: simulation(dt=1e300).step(), r"not finite|inf|farther .* numbers tell"),
    ("theta 0.4", lambda: cn.NSCD(theta=0.4), r"theta is 0.4.*give"),
    ("theta nan", lambda: cn.NSCD(theta=NAN), r"theta is nan.*give"),
    ("tol 0", lambda: cn.NLGS(tol=0.0), r"tol is 0.*give"),
    ("max_iter 0", lambda: cn.NLGS(max_iter=0), r"max_iter is 0.*give"),
    ("margin nan", lambda: cn.NSCD(margin=NAN), r"margin is nan.*give"),
    ("position set to nan", moved("position", NAN), r"position\[0, 1\] is nan.*give"),
    ("velocity set to inf", moved("velocity", INF), r"velocity\[0, 1\] is inf.*give"),
]
