"""Structures of blocks as engineers assess them: a load that moves over, supports that settle, a push to collapse, an earthquake.

Each procedure makes its simulation of blocks, goes through it in small steps, and returns arrays with a picture, `plot()`.
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import replace

import numpy as np

from ..base import checks
from ..names import teach
from ..pre import loads
from ..pre.blocks import Blocks, face_table
from ..pre.import_report import BlocksWarning
from .assessment_results import Passage, Path, Shaken
from .masonry import Structure

G = 9.81
LIGHT = 0.01  # weight of an axle over that of the lightest block
FALL = 0.02  # of the structure's size: a block that moved farther than that from where it is led has fallen
QUICK = 20.0  # times the speed at which supports or blocks are moved: a structure that moves faster collapses
SLOWLY = 8.0  # times sqrt(size / g): how long a slow load is on its way
UP = 0.05  # vertical share of a normal that looks up


# ---------------------------------------------------------------------- procedures


def moving_load(
    blocks: Blocks,
    load,
    joint=0.6,
    *,
    axles=(0.0,),
    start=None,
    end=None,
    positions=41,
    spread=0.0,
    width=None,
    speed=None,
    limit=True,
    density=2400.0,
    dt=2e-3,
    strategy=None,
    progress=False,
) -> Passage:
    """Moves axles over a structure, from its left end to its right end along x.

    Each axle presses on the highest faces that look up at its place. The load moves so slowly that the structure is near
    equilibrium, at `speed`, or quicker: then the inertia of blocks counts, that of the vehicle does not.

    Parameters
    ----------
    blocks : Blocks
        The structure; its part "support" is held.
    load : float or sequence of float
        Weight of each axle [N], one number for all; in 2D for the depth of the scene, 1 m.
    joint : float or Law, default 0.6
        Coefficient of friction of all joints, or their law.
    axles : sequence of float, default (0.0,)
        Places of the axles relative to the first one [m], such as (0, -3.6).
    start, end : float, optional
        Places of the first axle along x at the beginning and the end [m]; the ends of the free blocks, and beyond for the rest
        of the axles, when not given.
    positions : int, default 41
        At how many places results are kept.
    spread : float, default 0
        Length along x over which an axle is spread [m].
    width : tuple of float, optional
        In 3D from where to where along y an axle presses [m]; the whole width of the free blocks when not given.
    speed : float, optional
        Speed of the load [m/s]; when not given, it is on its way for 8 sqrt(size of the structure / g).
    limit : bool, default True
        Whether limit analysis finds the multiplier of the load at collapse at each place; needs a coefficient of friction.
    density : float, default 2400
        Density of the blocks [kg/m3].
    dt : float, default 2e-3
        Length of a step [s].
    strategy : NSCD, optional
        Strategy of the simulation; by default theta 1, and sweeps to 1e-6.
    progress : bool, default False
        Prints each place to the standard error.

    Returns
    -------
    Passage
        Deflections, multipliers, and where the structure fell.

    Raises
    ------
    ValueError
        If an argument is wrong, the structure falls without the load, or no place has a face below an axle.
    """
    blocks = _checked(blocks)
    axles = checks.real_array("axles", np.atleast_1d(np.asarray(axles, float)), (None,))
    load = checks.spread("load", load, axles.shape, ", the weight of each axle [N]")
    if not np.all(load > 0):
        raise ValueError(f"load is {load.tolist()}: give the weight of each axle above 0 [N]; it acts downwards")
    _mind_the_weight(load, blocks, density)
    positions = checks.count("positions", positions, 2)
    spread = checks.number("spread", spread)
    if spread < 0:
        raise ValueError(f"spread is {spread}: give a length >= 0 [m]")
    road = _Road(blocks, spread, width)
    start = road.low - 0.0 if start is None else checks.number("start", start)
    end = road.high - axles.min() if end is None else checks.number("end", end)
    if not start < end:
        raise ValueError(f"start is {start} and end {end}: give start below end [m]")
    if speed is None:
        speed = (end - start) / (SLOWLY * np.sqrt(_size(blocks) / G))
    speed = checks.positive("speed", speed)
    places = np.linspace(start, end, positions)
    resultants = np.array([sum(road.resultants(p + a, w) for a, w in zip(axles, load)) for p in places])
    if not np.any(resultants):
        raise ValueError(
            f"no free block has a face that looks up below an axle between x = {start} and {end}: mind start and end"
        )
    multipliers = _limits(blocks, joint, density, resultants) if limit else np.full(positions, np.nan)
    begin, h = 0.05, (end - start) / speed / (positions - 1)

    def pressing(t):
        s = np.clip((t - begin) / h, 0.0, positions - 1)
        k = min(int(s), positions - 2)
        return (1 - (s - k)) * resultants[k] + (s - k) * resultants[k + 1]

    structure = _begin(blocks, joint, density, dt, strategy, forces=pressing)
    size, at_rest = _size(blocks), _settle(structure, round(begin / dt))
    deflection, fell = np.full((positions, len(blocks)), np.nan), None
    for k in range(positions):
        while structure.simulation.time < begin + k * h - 0.5 * dt:
            structure.simulation.step()
        away = structure.places()[0] - at_rest
        if fell is None and np.max(np.linalg.norm(away[~structure.held], axis=1)) > FALL * size:
            fell = float(places[k])
        if fell is not None:
            break
        deflection[k] = away[:, -1]
        _told(progress, f"axle at {places[k]:.4g} m: {1e3 * np.min(deflection[k]):.3g} to {1e3 * np.max(deflection[k]):.3g} mm")
    return Passage(places, deflection, multipliers, fell, structure)


def settlement(
    blocks: Blocks,
    displacement,
    joint=0.6,
    *,
    supports=None,
    speed=0.02,
    density=2400.0,
    dt=2e-3,
    outputs=200,
    strategy=None,
    progress=False,
) -> Path:
    """Moves supports until the structure collapses, or to the end of the way.

    Parameters
    ----------
    blocks : Blocks
        The structure; its part "support" is held.
    displacement : sequence of float (dim,)
        Way of the supports [m], (0, -0.1) for a settlement in 2D, (-0.1, 0) for one that spreads to the left.
    joint : float or Law, default 0.6
        Coefficient of friction of all joints, or their law.
    supports : array_like of int or bool, optional
        Which blocks are moved, numbers or mask (n,); by default those supports that lie to the left of the middle.
    speed : float, default 0.02
        Speed of the supports [m/s], reached within a tenth of the time.
    density : float, default 2400
        Density of the blocks [kg/m3].
    dt : float, default 2e-3
        Length of a step [s].
    outputs : int, default 200
        At how many displacements results are kept.
    strategy : NSCD, optional
        Strategy of the simulation; by default theta 1, and sweeps to 1e-6.
    progress : bool, default False
        Prints each output to the standard error.

    Returns
    -------
    Path
        Forces on the supports, and the displacement at collapse: the last one at which no block was 20 times as fast as the
        supports, before one had moved by a fiftieth of the structure's size more than they did.

    Raises
    ------
    ValueError
        If an argument is wrong, or the structure falls before its supports move.
    """
    blocks, dim = _checked(blocks), blocks.dim
    way = checks.real_array("displacement", displacement, (dim,))
    if not np.any(way):
        raise ValueError(f"displacement is {way}: give one of non-zero length [m]")
    if np.linalg.norm(way) > _size(blocks):
        told = f"displacement is {np.linalg.norm(way):.4g} m long, and the structure {_size(blocks):.4g} m: give metres"
        warnings.warn(told, BlocksWarning, stacklevel=2)
    mask = _chosen(blocks, supports)
    return _led(blocks, joint, way, mask, None, speed, density, dt, outputs, strategy, progress, "settlement", None)


def pushover(
    blocks: Blocks,
    displacement,
    joint=0.6,
    *,
    at=None,
    loads=None,
    speed=0.02,
    density=2400.0,
    dt=2e-3,
    outputs=200,
    strategy=None,
    progress=False,
) -> Path:
    """Pushes blocks along a way, free to rise and to turn, and records the push: a capacity curve.

    Parameters
    ----------
    blocks : Blocks
        The structure; its part "support" is held.
    displacement : sequence of float (dim,)
        Horizontal way of the pushed blocks [m].
    joint : float or Law, default 0.6
        Coefficient of friction of all joints, or their law.
    at : str, int or sequence of int, optional
        Part or numbers of the pushed blocks; the highest block when not given. Their centres are led.
    loads : ndarray (n, dim), optional
        Forces on the blocks that act all the time [N], such as the load on top of a wall.
    speed : float, default 0.02
        Speed of the blocks [m/s], reached within a tenth of the time.
    density : float, default 2400
        Density of the blocks [kg/m3].
    dt : float, default 2e-3
        Length of a step [s].
    outputs : int, default 200
        At how many displacements results are kept.
    strategy : NSCD, optional
        Strategy of the simulation; by default theta 1, and sweeps to 1e-6.
    progress : bool, default False
        Prints each output to the standard error.

    Returns
    -------
    Path
        Forces and displacements; `peak` is the largest push, `collapse` the displacement at which blocks began to fall.

    Raises
    ------
    ValueError
        If an argument is wrong, or the structure falls before it is pushed.
    """
    blocks, dim = _checked(blocks), blocks.dim
    way = checks.real_array("displacement", displacement, (dim,))
    if not np.any(way) or way[-1]:
        raise ValueError(f"displacement is {way}: give a horizontal vector of non-zero length [m]")
    free = ~blocks.mask("support")
    if at is None:
        top = np.array([v[:, -1].max() for v in blocks.vertices])
        mask = np.zeros(len(blocks), bool)
        mask[int(np.argmax(np.where(free, top, -np.inf)))] = True
    elif isinstance(at, str):
        mask = blocks.mask(at)
    else:
        mask = _numbers("at", at, len(blocks))
    if not mask.any() or np.any(mask & ~free):
        what = "no block" if not mask.any() else "a support"
        raise ValueError(f"at is {at!r}, which is {what}: give free blocks; the parts are {', '.join(sorted(set(blocks.part)))}")
    if loads is not None:
        loads = checks.real_array("loads", loads, (len(blocks), dim))
    return _led(blocks, joint, way, mask, loads, speed, density, dt, outputs, strategy, progress, "pushover", way)


def quake(
    blocks: Blocks,
    record,
    joint=0.6,
    *,
    direction=None,
    rest=1.0,
    fall=0.1,
    density=2400.0,
    dt=2e-3,
    outputs=400,
    strategy=None,
    progress=False,
) -> Shaken:
    """Shakes the supports of a structure, and finds what drift remains.

    Parameters
    ----------
    blocks : Blocks
        The structure; its part "support" is held.
    record : Accelerogram
        Acceleration of the ground, as cairn.pre.loads.read_accelerogram reads it.
    joint : float or Law, default 0.6
        Coefficient of friction of all joints, or their law.
    direction : sequence of float (dim,), optional
        Direction of the record, whose length multiplies it; along x when not given.
    rest : float, default 1
        Time after the record [s], in which blocks come to rest.
    fall : float, default 0.1
        Share of the structure's size by which a block that fell has left its place; then the simulation ends.
    density : float, default 2400
        Density of the blocks [kg/m3].
    dt : float, default 2e-3
        Length of a step [s].
    outputs : int, default 400
        At how many instants results are kept.
    strategy : NSCD, optional
        Strategy of the simulation; by default theta 1, and sweeps to 1e-6.
    progress : bool, default False
        Prints each tenth of the time to the standard error.

    Returns
    -------
    Shaken
        Drift of all blocks over time; `permanent`, `largest`, `fell`.

    Raises
    ------
    ValueError
        If an argument is wrong, or the structure falls before the record begins.
    """
    blocks, dim = _checked(blocks), blocks.dim
    if not isinstance(record, loads.Accelerogram):
        raise ValueError(f"record is {record!r}: give a cairn.pre.loads.Accelerogram, as read_accelerogram(path) gives it")
    direction = np.eye(dim)[0] if direction is None else checks.real_array("direction", direction, (dim,))
    rest, outputs = checks.number("rest", rest), checks.count("outputs", outputs, 2)
    fall, first = checks.positive("fall", fall), 0.05
    shifted = loads.Accelerogram(record.times - record.times[0] + first, record.acceleration, record.name)
    drive = shifted.drive(direction)
    end = shifted.times[-1]

    def moving(t):
        return drive(t) if first <= t <= end else np.zeros(dim + (1 if dim == 2 else 3))

    structure = _begin(blocks, joint, density, dt, strategy, drive=(blocks.mask("support"), moving))
    size, base = _size(blocks), np.flatnonzero(structure.held)[0]
    begin = _settle(structure, round(first / dt))
    times, ground, drift, fell = [], [], [], None
    every = max(1, round((end + rest - first) / dt / outputs))
    steps = round((end + rest - first) / dt)
    for k in range(1, steps + 1):
        structure.simulation.step()
        if k % every and k < steps:
            continue
        now = structure.places()[0] - begin
        times.append(structure.simulation.time - first)
        ground.append(now[base])
        drift.append(now - now[base])
        if k % (every * max(1, outputs // 10)) == 0:
            _told(progress, f"{times[-1]:.3g} s: largest drift {1e3 * np.max(np.linalg.norm(drift[-1], axis=1)):.3g} mm")
        if np.max(np.linalg.norm(drift[-1], axis=1)) > fall * size:
            fell = float(times[-1])
            break
    return Shaken(np.array(times), np.array(ground), np.array(drift), fell, structure)


# ---------------------------------------------------------------------- parts of them


class _Road:
    """Faces of the free blocks that look up, and the resultants of axles on them."""

    def __init__(self, blocks, spread, width):
        self.dim, self.spread = blocks.dim, spread
        _, owner, normal, loops = face_table(blocks)
        free = ~blocks.mask("support")
        keep = [k for k in range(len(owner)) if normal[k, -1] > UP and free[owner[k]]]
        if not keep:
            raise ValueError("no free block has a face that looks up: an axle has no road")
        self.owner, self.normal, self.loops = owner[keep], normal[keep], [loops[k] for k in keep]
        self.center, self.count = blocks.properties().center, len(blocks)
        low, high = blocks.select(free).bounds()
        self.low, self.high = low[0], high[0]
        if width is None:
            width = (low[1], high[1]) if self.dim == 3 else (0.0, 0.0)
        self.width = checks.real_array("width", width, (2,))
        if self.dim == 3 and not self.width[0] < self.width[1]:
            raise ValueError(f"width is {width}: give (y0, y1) [m], y0 below y1")

    def resultants(self, x, weight):
        """Resultants (n, 3 | 6) of an axle at x; none beyond the road."""
        out = np.zeros((self.count, self.dim + (1 if self.dim == 2 else 3)))
        xs = [x] if self.spread == 0 else x + self.spread * (np.arange(16) + 0.5) / 16 - self.spread / 2
        ys = [0.0] if self.dim == 2 else self.width[0] + (np.arange(16) + 0.5) / 16 * np.ptp(self.width)
        down = -weight / (len(xs) * len(ys)) * np.eye(self.dim)[-1]
        for px in xs:
            for py in ys:
                found = self.highest(np.array([px] if self.dim == 2 else [px, py]))
                if found is not None:
                    body, point = found
                    out[body] += loads.point_load(down, point, self.center[body])
        return out

    def highest(self, place):
        """Block and point of the highest face above a place (dim - 1,); None where there is none."""
        best = None
        for owner, normal, loop in zip(self.owner, self.normal, self.loops):
            flat = loop[:, :-1]
            if np.any(place < flat.min(axis=0)) or np.any(place > flat.max(axis=0)):
                continue
            if self.dim == 3:
                edge, arm = np.roll(flat, -1, axis=0) - flat, place - flat
                if np.any(edge[:, 0] * arm[:, 1] - edge[:, 1] * arm[:, 0] < 0):
                    continue
            height = loop[0, -1] - (place - flat[0]) @ normal[:-1] / normal[-1]
            if best is None or height > best[1][-1]:
                best = owner, np.append(place, height)
        return best


def _checked(blocks):
    if not isinstance(blocks, Blocks):
        raise ValueError(f"blocks is {blocks!r}: give Blocks, as cairn.pre.masonry.arch(...) and the like make them")
    if not np.any(blocks.mask("support")):
        raise ValueError('blocks have no part "support": name the blocks that stand on the ground so, blocks.part[k] = "support"')
    if np.all(blocks.mask("support")):
        raise ValueError('all blocks are of the part "support": nothing can move')
    return blocks


def _mind_the_weight(load, blocks, density):
    """Warns of axles that weigh far less than any block, as if given in kN."""
    free = ~blocks.mask("support")
    volume = blocks.properties().measure[free]
    weight = checks.positive("density", density) * G * float(volume.min())
    if load.max() < LIGHT * weight:
        told = f"load is {load.max():g} N, and the lightest block weighs {weight:.4g} N: give newtons"
        warnings.warn(f"{told}, {1e3 * load.max():g} for {load.max():g} kN", BlocksWarning, stacklevel=3)


def _numbers(name, given, n):
    """Mask (n,) from numbers or a mask."""
    given, mask = np.atleast_1d(given), np.zeros(n, bool)
    if given.dtype == bool:
        if given.shape != (n,):
            raise ValueError(f"{name} has shape {given.shape}: give a mask of the {n} blocks, or their numbers")
        return given
    wrong = [k for k in given.tolist() if not isinstance(k, int) or not -n <= k < n]
    if wrong:
        raise ValueError(f"{name} names block {wrong[0]!r}: there are blocks 0 to {n - 1}")
    mask[given] = True
    return mask


def _chosen(blocks, supports):
    """Mask of the supports that move."""
    held = blocks.mask("support")
    if supports is None:
        middle = np.array([v[:, 0].mean() for v in blocks.vertices])
        low, high = blocks.bounds()
        mask = held & (middle < (low[0] + high[0]) / 2)
    else:
        mask = _numbers("supports", supports, len(blocks))
    if not mask.any() or np.any(mask & ~held):
        told = "no support lies to the left of the middle" if supports is None else f"supports is {supports!r}"
        raise ValueError(f'{told}: give numbers of blocks of the part "support", which are {np.flatnonzero(held).tolist()}')
    return mask


def _begin(blocks, joint, density, dt, strategy, forces=None, drive=None, pushed=None):
    """A Structure at the start. forces: function of time (n, 3 | 6); drive: mask of supports and their velocity over time;
    pushed: mask of blocks, their driven dofs and velocity over time."""
    from .. import NLGS, NSCD, Coulomb, Law, Material, Scene, Simulation

    scene = Scene(blocks.dim, gravity=-G * np.eye(blocks.dim)[-1])
    density = checks.positive("density", density)
    sets, rows = blocks.sets(Material("stone", density=density))
    order, first = np.argsort(rows), np.cumsum([0] + [len(s) for s in sets])
    for k, (a, b) in enumerate(zip(first[:-1], first[1:])):
        own = order[a:b]
        if forces is not None and sets[k].group != "support":
            sets[k] = sets[k].with_(force=lambda t, own=own: forces(t)[own])
        if drive is not None and drive[0][own].any():
            sets[k] = sets[k].with_(drive=lambda t, of=drive[0][own][:, None]: np.where(of, drive[1](t), 0.0))
    ids = scene.add(*sets)[rows]
    law = joint if isinstance(joint, Law) else Coulomb(mu=checks.positive("joint", joint))
    scene.interact("*", "*", law)
    strategy = NSCD(theta=1.0, solver=NLGS(tol=1e-6, max_iter=20_000)) if strategy is None else strategy
    simulation = Simulation(scene, dt=dt, strategy=strategy)
    if pushed is not None:
        mask, dofs, velocity = pushed
        simulation.drive(ids[mask], dofs, velocity)
    structure = Structure(blocks, simulation, ids)
    structure.law_is_friction = type(law) is Coulomb
    return structure


def _settle(structure, steps):
    """Makes steps under the weight alone, and gives the places of the blocks; refuses what falls.

    Structures are built on centring: they start from a state of rest where there is one, which blocks that are let go at once
    need not take (see the documentation on limit analysis)."""
    from ..run.equilibrium import find_equilibrium

    if structure.law_is_friction:
        find_equilibrium(structure.simulation)
    for _ in range(steps):
        structure.simulation.step()
    time = structure.simulation.time
    speed = structure.balance()["speed"]
    if speed > 0.05 * G * time:
        raise ValueError(f"the structure falls under its own weight (blocks at {speed:.3g} m/s after {time:.3g} s): "
                         "it needs supports, thickness or friction")  # fmt: skip
    return structure.places()[0].copy()


def _size(blocks):
    low, high = blocks.bounds()
    return float(np.max(high - low))


def _limits(blocks, joint, density, resultants):
    """Multipliers (p,) of loads (p, n, 3 | 6) by limit analysis; inf where no multiple of them collapses the structure."""
    from .limit_analysis import Assembly

    if not isinstance(joint, (int, float)):
        mu = getattr(joint, "mu", None)
        if type(joint).__name__ != "Coulomb" or mu is None:
            raise ValueError(f"limit analysis knows friction alone, and joint is {joint!r}: give limit=False")
        joint = mu
    assembly = Assembly(blocks, joint, density=density)
    out = []
    for load in resultants:
        found = assembly.collapse(load) if np.any(load) else None
        out.append(np.inf if found is None or found.status == "unbounded" else found.multiplier if found else np.nan)
    return np.where(np.isinf(out), np.nan, out)


def _led(blocks, joint, way, mask, dead, speed, density, dt, outputs, strategy, progress, kind, push):
    """A Path of blocks that are led along a way."""
    dim, length = blocks.dim, float(np.linalg.norm(way))
    speed, outputs, first = checks.positive("speed", speed), checks.count("outputs", outputs, 2), 0.05
    unit, duration = way / length, length / speed / 0.9
    velocity = loads.displaced(np.append(way, np.zeros(1 if dim == 2 else 3)), duration, first, ramp=0.1)
    forces = None
    if dead is not None:
        whole = np.concatenate([dead, np.zeros((len(blocks), 1 if dim == 2 else 3))], axis=1)
        forces = lambda t: whole  # noqa: E731
    names = ("vx", "vy", "vz")[: dim - 1]
    structure = _begin(blocks, joint, density, dt, strategy, forces, drive=(mask, velocity) if push is None else None,
                       pushed=None if push is None else (mask, names, _over_all(velocity)))  # fmt: skip
    begin, size = _settle(structure, round(first / dt)), _size(blocks)
    steps = round(duration / dt)
    every = max(1, steps // outputs)
    free, lead = ~structure.held & ~mask, np.flatnonzero(mask)[0]
    way_now, force, moved, quiet, fell = [], [], [], 0.0, False
    weight = float(np.linalg.norm(structure.weight().sum(axis=0)))
    for k in range(1, steps + 1):
        structure.simulation.step()
        now = structure.places()[0] - begin
        s = float(now[lead] @ unit)
        velocities = structure.simulation.bodies.velocity[structure.rows()][free, :dim]
        away = np.linalg.norm(now[free], axis=1)
        if np.max(np.linalg.norm(velocities, axis=1), initial=0.0) <= QUICK * speed:
            quiet = s
        fell = np.max(away, initial=0.0) > max(s, 0.0) + FALL * size and quiet < s
        if k % every == 0 or fell:
            way_now.append(s), moved.append(float(np.max(away, initial=0.0))), force.append(_on(structure, mask))
            _told(progress, f"{1e3 * s:.4g} mm: force {force[-1]} N")
        if fell:
            break
    found = Path(np.array(way_now), np.array(force), np.array(moved), quiet if fell else None, weight, structure, kind, unit)
    return found if kind == "settlement" else replace(found, collapse=_without_push(found))


def _without_push(path):
    """Displacement at which the push has fallen to 0 after its peak, or that of the fall if it came first."""
    push, s = path.push, path.displacement
    after = np.flatnonzero((push <= 0) & (np.arange(len(push)) > np.argmax(push)))
    if not len(after):
        return path.collapse
    k = after[0]
    none = s[k - 1] + (s[k] - s[k - 1]) * push[k - 1] / (push[k - 1] - push[k])
    return float(none if path.collapse is None else min(none, path.collapse))


def _over_all(velocity):
    return lambda t: velocity(t)


def _on(structure, mask):
    """Sum (dim,) of the contact forces of the other blocks on those of a mask [N]."""
    numbers, _, _, force = structure.contacts()
    first, second = mask[numbers[:, 0]], mask[numbers[:, 1]]
    return force[first & ~second].sum(axis=0) - force[second & ~first].sum(axis=0)


def _told(progress, line):
    if progress:
        print(line, file=sys.stderr, flush=True)


teach(globals())
