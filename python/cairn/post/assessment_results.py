"""Results of assessments, each with a picture: a load that passed, a path of pushing, a structure that was shaken."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..base import checks


@dataclass(frozen=True)
class Passage:
    """A load that moved over a structure.

    Parameters
    ----------
    position : ndarray (p,)
        Places of the first axle along x [m].
    deflection : ndarray (p, n)
        Vertical displacements of the blocks [m]; nan once the structure has fallen.
    limit : ndarray (p,)
        Multiplier of the load at collapse by limit analysis; nan unless it was asked for.
    fell : float or None
        Place of the first axle at which the structure began to fall [m].
    structure : Structure
        The structure at the end.
    """

    position: np.ndarray
    deflection: np.ndarray
    limit: np.ndarray
    fell: float | None
    structure: object = field(repr=False)

    @property
    def least(self):
        """Least multiplier of limit analysis over all places, and its place [m]."""
        if np.all(np.isnan(self.limit)):
            raise ValueError("no multipliers were found: call moving_load(..., limit=True)")
        k = int(np.nanargmin(self.limit))
        return float(self.limit[k]), float(self.position[k])

    def plot(self, axes=None):
        """Draws multiplier and largest deflection over the place of the load.

        Parameters
        ----------
        axes : sequence of matplotlib.axes.Axes, optional
            Two axes; a new figure if not given.

        Returns
        -------
        list of matplotlib.axes.Axes
            The axes.
        """
        upper, lower = _axes(2, axes)
        if not np.all(np.isnan(self.limit)):
            least, at = self.least
            upper.semilogy(self.position, self.limit, color="#7a4b2a")
            upper.plot(at, least, "o", color="#8c1515", label=f"least {least:.4g} at {at:.4g} m")
            upper.axhline(1.0, color="0.6", linewidth=0.8)
            upper.legend()
        upper.set(ylabel="load at collapse\nover the load", xlabel="place of the first axle [m]")
        lower.plot(self.position, -1e3 * np.min(self.deflection, axis=1), label="down", color="#8c1515")
        lower.plot(self.position, 1e3 * np.max(self.deflection, axis=1), label="up", color="#1f4e9c")
        if self.fell is not None:
            for ax in (upper, lower):
                ax.axvline(self.fell, color="black", linestyle=":", label="falls")
        lower.set(ylabel="largest displacement [mm]", xlabel="place of the first axle [m]")
        lower.legend()
        return [upper, lower]


@dataclass(frozen=True)
class Path:
    """A structure led along a path of displacement: supports that settle, or blocks that are pushed.

    Parameters
    ----------
    displacement : ndarray (p,)
        How far supports or blocks were moved [m].
    force : ndarray (p, dim)
        Force [N] of all other blocks on those that were moved; a push of blocks needs the opposite.
    moved : ndarray (p,)
        Largest displacement of a free block [m].
    collapse : float or None
        Displacement [m] at which the structure began to collapse, of a pushover also where the push has fallen to 0; None if it
        did not.
    weight : float
        Weight of all free blocks [N].
    structure : Structure
        The structure at the end.
    kind : str
        "settlement" or "pushover".
    direction : ndarray (dim,)
        Unit vector of the displacement.
    """

    displacement: np.ndarray
    force: np.ndarray
    moved: np.ndarray
    collapse: float | None
    weight: float
    structure: object = field(repr=False)
    kind: str = "pushover"
    direction: np.ndarray | None = None

    @property
    def push(self):
        """Force along the displacement (p,) [N] that holds the blocks on their path."""
        return -self.force @ self.direction

    @property
    def peak(self):
        """Largest push [N] and the displacement at it [m]."""
        k = int(np.argmax(self.push))
        return float(self.push[k]), float(self.displacement[k])

    def plot(self, ax=None):
        """Draws the force over the displacement, with the displacement at collapse.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; a new figure if not given.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.
        """
        ax = _axes(1, None if ax is None else [ax])[0]
        if self.kind == "pushover":
            ax.plot(1e3 * self.displacement, self.push / self.weight, color="#7a4b2a")
            top, at = self.peak
            ax.plot(1e3 * at, top / self.weight, "o", color="#8c1515", label=f"peak {top / self.weight:.3g} of the weight")
            ax.set(ylabel="push over the weight of all blocks", xlabel="displacement [mm]")
        else:
            for axis in range(self.force.shape[1]):
                name = "xyz"[axis] if self.force.shape[1] == 3 else "xy"[axis]
                ax.plot(1e3 * self.displacement, self.force[:, axis] / self.weight, label=f"along {name}")
            ax.set(ylabel="force on the moved supports\nover the weight of all blocks", xlabel="displacement of supports [mm]")
        if self.collapse is not None:
            ax.axvline(1e3 * self.collapse, color="black", linestyle=":", label=f"collapse at {1e3 * self.collapse:.4g} mm")
        ax.legend()
        return ax


@dataclass(frozen=True)
class Shaken:
    """A structure in an earthquake.

    Parameters
    ----------
    time : ndarray (p,)
        Instants [s].
    ground : ndarray (p, dim)
        Displacement of the ground [m].
    drift : ndarray (p, n, dim)
        Displacements of the blocks against the ground [m].
    fell : float or None
        Instant at which a block had left its place by the share `fall` of the structure's size [s].
    structure : Structure
        The structure at the end.
    """

    time: np.ndarray
    ground: np.ndarray
    drift: np.ndarray
    fell: float | None
    structure: object = field(repr=False)

    @property
    def permanent(self):
        """Displacements (n, dim) of the blocks against the ground at the end [m]."""
        return self.drift[-1]

    @property
    def largest(self):
        """Largest distance (n,) of the blocks from their places on the ground at any time [m]."""
        return np.max(np.linalg.norm(self.drift, axis=2), axis=0)

    def plot(self, axes=None, blocks=3):
        """Draws the drift of the blocks that moved most over time, and the permanent drift of all.

        Parameters
        ----------
        axes : sequence of matplotlib.axes.Axes, optional
            Two axes; a new figure if not given.
        blocks : int, default 3
            How many blocks are drawn over time.

        Returns
        -------
        list of matplotlib.axes.Axes
            The axes.
        """
        from .masonry_plots import draw

        upper, lower = _axes(2, axes)
        way = _main_direction(self.ground)
        order = np.argsort(-np.where(self.structure.held, -1.0, self.largest), kind="stable")[: np.sum(~self.structure.held)]
        for k in order[: checks.count("blocks", blocks, 1)]:
            upper.plot(self.time, 1e3 * self.drift[:, k] @ way, label=f"block {k}")
        ground = upper.twinx()
        ground.plot(self.time, 1e3 * self.ground @ way, color="0.75", linewidth=0.8, zorder=0)
        ground.set_ylabel("ground [mm]", color="0.5")
        upper.set(xlabel="time [s]", ylabel="drift against the ground [mm]")
        upper.legend()
        draw(self.structure, lower, what=1e3 * np.linalg.norm(self.permanent, axis=1), forces=False,
             label="permanent drift [mm]")  # fmt: skip
        return [upper, lower]


def _main_direction(ground):
    """Unit vector along which the ground moved farthest."""
    reach = np.ptp(ground, axis=0)
    return reach / np.linalg.norm(reach) if np.any(reach) else np.eye(ground.shape[1])[0]


def _axes(count, given):
    """Gives axes one below the other, or those given."""
    from .drawing import _pyplot

    if given is not None:
        if np.size(given) != count:
            raise ValueError(f"axes are {np.size(given)}: give {count}, of pyplot.subplots({count})")
        return list(np.ravel(given))
    return list(np.atleast_1d(_pyplot().subplots(count, 1, figsize=(8.0, 3.2 * count + 0.6), layout="constrained")[1]))
