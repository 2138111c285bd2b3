"""Open ends of a liquid: buffers in which particles come in and leave."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base import checks


def _box(name, region):
    region = checks.reals("region", region)
    if region.ndim != 2 or region.shape[0] != 2 or region.shape[1] not in (2, 3) or not np.all(region[1] > region[0]):
        raise ValueError(f"region of {name} is {region.tolist()}: give its lowest corner, then its highest one, (2, dim) [m]")
    if not np.all(np.isfinite(region)):
        raise ValueError(f"region of {name} holds numbers that are not finite: give finite coordinates [m]")
    return region


@dataclass(frozen=True, eq=False)
class Inflow:
    """A box before a liquid, out of which more of it comes.

    Parameters
    ----------
    region : array_like (2, dim)
        Lowest and highest corner of the box [m], which begins where the liquid ends and is at least as long as particles reach, 3
        spacings by default. Whole spacings fill it, as those of `fluid`.
    velocity : array_like (dim,) or callable
        Velocity with which the liquid comes [m/s], along one axis; or a function of places (n, dim) that gives (n, dim), of which
        each row of particles takes its own.

    Raises
    ------
    ValueError
        If the region is no box, or a velocity that is given leads along no axis.

    Notes
    -----
    Particles in the box keep their velocity and have the pressure of the liquid beside them, as buffers in Tafuni et al. (2018).
    Each that leaves the box is followed by another at its begin, so that the rate of mass is that of the velocities.
    """

    region: object
    velocity: object

    is_fluid_end = True

    def __post_init__(self):
        object.__setattr__(self, "region", _box("cn.Inflow", self.region))
        object.__setattr__(self, "dim", self.region.shape[1])
        if callable(self.velocity):
            return
        velocity = checks.reals("velocity", self.velocity)
        if velocity.shape != (self.dim,) or not np.all(np.isfinite(velocity)) or np.count_nonzero(velocity) != 1:
            raise ValueError(f"velocity of cn.Inflow is {velocity.tolist()}: give one along an axis, ({self.dim},) [m/s]")
        object.__setattr__(self, "velocity", velocity)

    def told(self):
        """Gives what checkpoints recognise it by.

        Returns
        -------
        tuple
            Kind and velocity [m/s], "function" in place of one.
        """
        return "inflow", "function" if callable(self.velocity) else self.velocity.tolist()

    def lanes(self, spacing, reach):
        """Fills the box with rows of particles along the flow.

        Parameters
        ----------
        spacing : float
            Distance of particles [m].
        reach : float
            Distance over which particles meet [m].

        Returns
        -------
        dict
            "position", "velocity" (n, dim) of the particles, "lane" (n,): the row of each, and of each row "axis", "sign",
            "face": the end of the box times the sign, "length" of the row and "speed".

        Raises
        ------
        ValueError
            If the box is too short, a function gives no finite velocities of the shape of places, or velocities do not lead along
            one axis in one direction.
        """
        low, high = self.region
        many, place = self._lattice(spacing)
        axis, sign, velocity = self._flow(place)
        if many[axis] * spacing < reach * (1 - 1e-9):
            raise ValueError(
                f"region of cn.Inflow is {many[axis] * spacing:g} m long, and particles reach over {reach:g} m: give it that "
                "length"
            )
        index = np.stack([x.ravel() for x in np.meshgrid(*[np.arange(m) for m in many], indexing="ij")], axis=1)
        across = np.delete(index, axis, axis=1)
        _, first, lane = np.unique(across, axis=0, return_index=True, return_inverse=True)
        speed = np.abs(velocity[first, axis])  # of the first particle of each row
        velocity[:, axis] = sign * speed[lane.ravel()]
        n = len(first)
        face = high[axis] if sign > 0 else -low[axis]
        if sign < 0:  # rows end at the liquid in whole spacings
            place[:, axis] += low[axis] + 0.5 * spacing - place[:, axis].min()
        else:
            place[:, axis] += high[axis] - 0.5 * spacing - place[:, axis].max()
        return {
            "position": place,
            "velocity": velocity,
            "lane": lane.ravel(),
            "axis": np.full(n, axis, np.int32),
            "sign": np.full(n, sign),
            "face": np.full(n, face),
            "length": np.full(n, many[axis] * spacing),
            "speed": speed,
        }

    def _lattice(self, spacing):
        """Particles along each axis (dim,), and their places (n, dim) [m]."""
        low, high = self.region
        many = np.round((high - low) / spacing).astype(int)
        if np.any(many < 1):
            raise ValueError(f"region of cn.Inflow is narrower than the spacing of the liquid, {spacing:g} m: give a wider one")
        axes = [low[k] + (np.arange(many[k]) + 0.5) * spacing for k in range(self.dim)]
        return many, np.stack([x.ravel() for x in np.meshgrid(*axes, indexing="ij")], axis=1)

    def _flow(self, place):
        """Axis and sign of the flow, and velocities (n, dim) at places [m/s]."""
        given = self.velocity(place.copy()) if callable(self.velocity) else np.broadcast_to(self.velocity, place.shape)
        velocity = checks.real_array("velocity of cn.Inflow", given, place.shape).copy()
        along = np.flatnonzero(np.any(velocity != 0, axis=0))
        if len(along) != 1 or np.any(velocity[:, along] < 0) and np.any(velocity[:, along] > 0):
            raise ValueError("velocity of cn.Inflow leads along several axes or both ways: give one along an axis, or 0")
        return int(along[0]), 1.0 if velocity[:, along].sum() > 0 else -1.0, velocity


@dataclass(frozen=True, eq=False)
class Outflow:
    """A box behind a liquid, into which it flows and is gone.

    Parameters
    ----------
    region : array_like (2, dim)
        Lowest and highest corner of the box [m], which begins where the liquid is to end and is at least as long as particles
        reach, 3 spacings by default.
    direction : array_like (dim,), optional
        Way out, along an axis; when not given, the way from the middle of the liquid at the start to the box, along the axis on
        which it is farthest.
    pressure : float or None, default 0
        Pressure in the box [Pa], the same at every height; None: that of each particle goes on from the one with which it came,
        as its density changes.

    Raises
    ------
    ValueError
        If the region is no box, or the direction leads along no axis.

    Notes
    -----
    A particle keeps in the box the velocity along the way out with which it came (Tafuni et al. 2018 have more), does not turn
    back, and is gone at the far end.
    """

    region: object
    direction: object = None
    pressure: float | None = 0.0

    is_fluid_end = True

    def __post_init__(self):
        object.__setattr__(self, "region", _box("cn.Outflow", self.region))
        object.__setattr__(self, "dim", self.region.shape[1])
        if self.direction is not None:
            way = checks.reals("direction", self.direction)
            if way.shape != (self.dim,) or np.count_nonzero(way) != 1 or not np.all(np.isfinite(way)):
                raise ValueError(f"direction of cn.Outflow is {way.tolist()}: give one along an axis, ({self.dim},)")
            object.__setattr__(self, "direction", way)
        if self.pressure is not None:
            object.__setattr__(self, "pressure", checks.number("pressure", self.pressure))

    def told(self):
        """Gives what checkpoints recognise it by.

        Returns
        -------
        tuple
            Kind, direction and pressure [Pa].
        """
        return "outflow", None if self.direction is None else np.asarray(self.direction).tolist(), self.pressure

    def row(self, middle, reach, origin):
        """Gives the numbers of the core.

        Parameters
        ----------
        middle : ndarray (dim,)
            Middle of the liquid at the start [m].
        reach : float
            Distance over which particles meet [m].
        origin : ndarray (dim,)
            Origin of the scene [m].

        Returns
        -------
        ndarray (9,)
            Lowest and highest corner in space, axis, sign and pressure.

        Raises
        ------
        ValueError
            If the box is too short, or holds the middle of the liquid and direction is not given.
        """
        low, high = self.region
        way = 0.5 * (low + high) - middle if self.direction is None else self.direction
        axis = int(np.argmax(np.abs(way)))
        if self.direction is None and np.all((low <= middle) & (middle <= high)):
            raise ValueError("region of cn.Outflow holds the middle of the liquid: give direction, along an axis")
        if high[axis] - low[axis] < reach * (1 - 1e-9):
            raise ValueError(
                f"region of cn.Outflow is {high[axis] - low[axis]:g} m long along axis {axis}, and particles reach over "
                f"{reach:g} m: give it that length, or direction"
            )
        out = np.zeros(9)
        out[: self.dim], out[3 : 3 + self.dim] = low - origin, high - origin
        out[6:] = axis, np.sign(way[axis]), np.nan if self.pressure is None else self.pressure
        return out
