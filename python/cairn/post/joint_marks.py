"""Joints in pictures: a ring where two points are held together, a line along a rod, a spring or a rope.

The ends of a joint are contactors of the bodies that it joins; those on the world are on bodies of their own, which are no
bodies of the scene and are neither drawn nor counted as such.
"""

import re

import numpy as np

OWN = re.compile(r"joint \d+ \(joint \d+\)")  # name of the material of a joint's marks, as the file has it


def bodies_of_joints(step):
    """Which rows of the bodies are ends of joints on the world, (n,) of bool."""
    species = step.run.scene.get("materials", ())
    species = [species] if isinstance(species, str) else species
    ends = [k for k, name in enumerate(species) if OWN.fullmatch(str(name))]
    if not ends or "material" not in step.bodies:
        return np.zeros(len(step.bodies), bool)
    return np.isin(step.bodies["material"], ends)


def of_contactors(step, contactors):
    """Which of the contactors are ends of joints, (m,) of bool: as the scene tells, in older files those on the world alone."""
    if contactors.joint is not None:
        return contactors.joint >= 0
    world = np.zeros(len(step.drawn), bool)
    world[: len(step.bodies)] = bodies_of_joints(step)
    return world[contactors.body]


def lines_and_rings(step, contactors):
    """Lines (k, 2, dim) [m] of rods, springs and ropes that hold at a step, places (r, dim) [m] of the other joints, and the
    radii of their marks (r,) [m]; empty for older files, which do not record the joint of each end."""
    kinds, lines, rings, radii = step.run.scene.get("joints") or {}, [], [], []
    if contactors.joint is None or not kinds:
        return np.zeros((0, 2, step.dim)), np.zeros((0, step.dim)), np.zeros(0)
    contacts, ids = step.contacts, np.asarray(step.drawn["id"])
    held = np.ones(len(contacts), bool) if "beta" not in contacts else contacts["beta"] > 0
    held = {frozenset(pair) for pair in zip(contacts["body_a"][held].tolist(), contacts["body_b"][held].tolist())}
    for number, spans, pulley in zip(*(np.atleast_1d(kinds[name]) for name in ("material", "spans", "pulley"))):
        ends = np.flatnonzero(contactors.joint == number)
        ends = ends[np.argsort(ids[contactors.body[ends]], kind="stable")]
        bodies, places = ids[contactors.body[ends]].tolist(), contactors.center[ends]
        if not any({a, b} in held for k, a in enumerate(bodies) for b in bodies[:k]):
            continue
        if pulley > 0:
            middle = int(pulley) - 1
            lines += [[places[middle], places[k]] for k in range(len(ends)) if k != middle]
        elif spans and len(ends) == 2:
            lines.append(places)
        else:
            rings.append(places[0])
            radii.append(contactors.radius[ends].max())
    return np.reshape(lines, (-1, 2, step.dim)), np.reshape(rings, (-1, step.dim)), np.array(radii)


def draw(ax, step, contactors, colour):
    """In the plane: rings and lines."""
    from matplotlib.collections import LineCollection

    lines, rings, _ = lines_and_rings(step, contactors)
    if len(lines):
        ax.add_collection(LineCollection(lines, colors=colour, linewidths=1.2, capstyle="round"), autolim=False)
    if len(rings):
        ax.scatter(*rings.T, s=28, facecolors="white", edgecolors=colour, linewidths=1.2, zorder=3)


def add_to(plotter, step, contactors, colour):
    """In space: balls and lines."""
    import pyvista

    lines, rings, radii = lines_and_rings(step, contactors)
    if len(lines):
        plotter.add_mesh(pyvista.line_segments_from_points(lines.reshape(-1, 3)), color=colour, line_width=3)
    small = 0.01 * plotter.length  # share of the picture, since joints on nodes have no size of their own
    for place, radius in zip(rings, radii):
        plotter.add_mesh(pyvista.Sphere(radius=radius or small, center=place), color=colour)
