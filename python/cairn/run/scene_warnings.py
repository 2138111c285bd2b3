"""Warnings of scenes in which nothing holds bodies against gravity or tension, nothing moves, or joints are far from their
bodies."""

from __future__ import annotations

import warnings

import numpy as np

from ..base import checks
from ..model.extents import Placed
from ..model.joint_ends import END
from .unit_warnings import holds_together
from .views import core_of

# distance of a joint from the nearer of its bodies over their size
FAR = 100.0
# shapes with faces, of bodies that move; walls and surfaces, on which these faces lie
FACES, GROUND = ("polygon", "polyhedron", "cylinder"), ("half_plane", "plane", "segment", "facet")
# steps of a run after which it is told that nothing moved
STEPS = 10


class SceneWarning(UserWarning):
    """A scene lacks what holds or moves its bodies: a mesh that touches nothing falls, a liquid has no walls, gravity acts along
    a periodic axis; a wall or a cell is pulled where no law holds bodies together; a ParallelBond joins faces; nothing moves in a
    run; or a joint is far from its bodies."""


def warn(simulation, above):
    """Warns of what a scene lacks. above: stack level of the warning."""
    scene = simulation.scene
    given = scene.gravity(simulation.time) if callable(scene.gravity) else scene.gravity
    gravity = checks.real_array("gravity", given, (scene.dim,))
    found = [_joints(simulation), _pulled_walls(simulation), _bonds_of_faces(simulation)]
    if np.any(gravity):
        found += [_meshes(simulation), _liquid(simulation, gravity), _cell(simulation, gravity)]
    for text in filter(None, found):
        warnings.warn(text, SceneWarning, stacklevel=above + 1)


def warn_of_tension(simulation, cell, above):
    """Warns of a periodic cell that is pulled, where nothing holds bodies together. cell: Periodic, or None."""
    stress = None if cell is None else cell.stress
    given = stress if isinstance(stress, dict) else {"all": stress}
    pulled = [name for name, value in given.items() if name in ("all", "xx", "yy", "zz") and _is_below_zero(value)]
    if pulled and not holds_together(simulation):
        value = given[pulled[0]]
        which = "stress" if pulled[0] == "all" else f"stress[{pulled[0]!r}]"
        text = f"{which} of the periodic cell is {value:g} Pa, a tension, and no law holds bodies together: the cell grows "
        text += f"without end; compression is positive, give {-value:g}, or a law with cohesion"
        warnings.warn(text, SceneWarning, stacklevel=above + 1)


def _bonds_of_faces(simulation):
    """Text on parallel bonds between faces, whose size is that of circumscribed balls instead of the face."""
    if not any(law is not None and law.name == "parallel_bond" for *_, law in simulation._rules):
        return None
    placed, known = Placed(core_of(simulation).scene), {number: pair for pair, number in simulation._species.items()}
    species = placed.field("material")
    faces, ground = (np.unique(species[np.isin(placed.shape, shapes)]) for shapes in (FACES, GROUND))
    laws = (simulation.scene.law_between(known[int(a)], known[int(b)]) for a in faces for b in np.union1d(faces, ground))
    if not any(law is not None and law.name == "parallel_bond" for law in laws):
        return None
    return "ParallelBond joins bodies with faces: each point of contact has a bond of its own, of the effective radius of " \
           "their circumscribed balls and not of the area of the face; give a law that takes the area, cn.MohrCoulomb, cn.MAL " \
           "or another of docs/cohesion.md"  # fmt: skip


def _is_below_zero(value):
    return isinstance(value, (int, float, np.number)) and value < 0


def _pulled_walls(simulation):
    """Text on a wall that a Servo pulls off, where nothing holds bodies together."""
    for s in simulation._sets:
        stress = getattr(s.force, "stress", None)
        if _is_below_zero(stress) and not holds_together(simulation):
            return f"stress of the {type(s.force).__name__} of body {int(s.ids[0])} is {stress:g} Pa, a tension, and no law " \
                   f"holds bodies to it: it leaves; compression is positive, give {-stress:g} or a law with cohesion"  # fmt: skip
    return None


def warn_of_rest(simulation, steps, above):
    """Warns of a run in which nothing moved, of a scene without gravity. steps: those of the run."""
    scene = simulation.scene
    if steps < STEPS or callable(scene.gravity) or np.any(scene.gravity) or scene.networks or scene.fluids:
        return
    if simulation.ranks is not None:  # they would gather the state of all bodies for it
        return
    if simulation.energy.get("largest_kinetic", 0.0) > 0:  # what moved may have come to rest
        return
    if np.any(simulation.bodies.velocity) or np.any(simulation.nodes.velocity) or not np.any(_free(simulation)):
        return
    up = ", ".join(["0"] * (scene.dim - 1) + ["-9.81"])
    text = f"nothing has moved in {steps} steps: all velocities are 0, and the scene has no gravity; give Scene({scene.dim}, "
    text += f"gravity=({up})), a velocity, a force or a driven wall"
    warnings.warn(text, SceneWarning, stacklevel=above + 1)


def _free(simulation):
    """True for rigid bodies that can move, (n,)."""
    every = 2 ** (3 * simulation.scene.dim - 3) - 1
    driven = core_of(simulation).scene.body("driven").ravel()
    free = np.isfinite(np.ravel(simulation.bodies.mass))
    return free & (driven != every) if len(driven) == len(free) else free


def _bound(simulation):
    """True if joints, ties or bonds of given places may hold bodies."""
    return any(law is not None and law.name in ("joint", "coupled_motion", "rod", "wire") for *_, law in simulation._rules)


def _meshes(simulation):
    """Text on a mesh that falls through all others, since it names no side that touches."""
    if _bound(simulation):
        return None
    for number, view in enumerate(simulation.meshes):
        d = view._mesh.d
        held = d.fixed or d.drive or d.displace or d.rigid or d.force or d.loads or d.pressed or d.joints
        if not held and not len(d.contact_nodes) and (len(simulation.bodies) or len(simulation.meshes) > 1):
            sides = "edges" if simulation.scene.dim == 2 else "faces"
            return f"mesh {number} falls through all other bodies, since none of its nodes and sides touches: give " \
                   f"cn.deformable(..., contact='boundary') for its nodes, or names of groups, {sides}= for its sides, or fixed="
    return None


def _liquid(simulation, gravity):
    """Text on a liquid that nothing holds."""
    scene = simulation.scene
    if not scene.fluids or len(simulation.bodies) or len(simulation.meshes):
        return None
    if scene.periodic is not None and not np.any(gravity[_endless(scene)]):
        return None
    return f"{scene.fluids[0].name!r} falls without end, since no body holds it: add walls, such as cn.wall, cn.segment or cn.box"


def _endless(scene):
    """True for axes along which the scene has no period, (dim,)."""
    lengths = np.asarray(scene.periodic.lengths, float)
    return ~(np.isfinite(lengths) & (lengths > 0))


def _cell(simulation, gravity):
    """Text on gravity along an axis of a periodic cell in which nothing is held."""
    scene = simulation.scene
    if scene.periodic is None or scene.fluids or len(simulation.meshes) or not len(simulation.bodies):
        return None
    along = np.flatnonzero((gravity != 0) & ~_endless(scene))
    if not len(along) or not np.all(_free(simulation)) or any(s.force is not None for s in simulation._sets):
        return None
    axis = "xyz"[along[0]]
    return f"gravity along {axis}, an axis of the periodic cell, accelerates all bodies without end, since none is held: give " \
           f"inf for the length along {axis} and a wall, or no gravity"  # fmt: skip


def _joints(simulation):
    """Text on a joint that is far from all of its bodies."""
    ends = {}
    for s in simulation._sets:
        world = s.mesh is not None or all(part.joint for part in s.contactors)
        for part in [] if world else s.contactors:
            if part.joint and part.offset is not None:
                arm = np.linalg.norm(part.offset, axis=1).min(initial=np.inf)
                size = np.max(part.radius, initial=0.0) / END
                ends.setdefault(part.material.name, []).append((float(arm), float(size), int(s.ids[part.body[0]])))
    for arms in ends.values():
        arm, size, body = min(arms)
        if arm > FAR * max(size for _, size, _ in arms) > 0:
            told = f"a joint of body {body} is at {arm:.3g} m from its centre, {arm / size:.3g} times its size"
            return told + ": give its point in axes of space, in metres"
    return None
