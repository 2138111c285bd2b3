"""A periodic cell, which may change its shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base import checks
from ..base.expressions import texts_of
from ..names import listed


@dataclass(frozen=True)
class Periodic:
    """A periodic cell, which may change its shape.

    Each component ij of its velocity gradient (xx, yy, zz, and xy, xz, yz: the face across j moves along i) may have a rate, or
    follow a stress; the others stay. With a stress the rates of the cell are unknowns of the step, as the velocities of bodies
    are, and the stress is that of the forces f of contacts across the boundary, - sum f_i s_j / V, s: shift of the image,
    which in equilibrium is that of all contacts (Radjai & Voivret 2011). NSCD alone makes such steps, by NLGS or Auto.

    Parameters
    ----------
    lengths : tuple (dim,)
        Length along each axis [m], inf or 0 along an axis that is not periodic.
    corner : tuple (dim,), optional
        Lowest corner [m]; zero when not given.
    lean : float, default 0
        Displacement along x of the cell's upper face [m].
    shear_rate : float, default 0
        Velocity of that face over the length of the cell along y in 2D, z in 3D [1/s].
    rate : dict, optional
        {component: rate [1/s]}, numbers or functions of time (Table, Harmonic, Expression); a length that shrinks has a negative
        rate.
    stress : float, callable or dict, optional
        Pressure along all axes [Pa], or {component: stress}, compression positive; the cell has to be periodic along all axes.
    constant_volume : bool, default False
        Lengths that have neither keep the volume.
    inertia : float, default 1
        Inertia of a cell that follows a stress, over the mass of its bodies [-]. It does not change what is slow.

    Examples
    --------
    >>> isotropic = cn.Periodic((1.0, 1.0, 1.0), stress=1e4)
    >>> triaxial = cn.Periodic((1.0, 1.0, 1.0), rate={"zz": -0.1}, stress={"xx": 1e4, "yy": 1e4})
    >>> sheared = cn.Periodic((1.0, 1.0), rate={"xy": 0.1}, stress={"yy": 1e4})
    >>> undrained = cn.Periodic((1.0, 1.0), rate={"yy": -0.1}, constant_volume=True)
    """

    lengths: tuple
    corner: tuple | None = None
    lean: float = 0.0
    shear_rate: float = 0.0
    rate: dict | None = None
    stress: Any = None
    constant_volume: bool = False
    inertia: float = 1.0

    def components(self, dim):
        """Gives what drives the cell, by component.

        Parameters
        ----------
        dim : int
            2 or 3.

        Returns
        -------
        tuple of dict
            Text of the rate [1/s] and of the stress [Pa] of each component, as the core compiles it.

        Raises
        ------
        ValueError
            If a component is none, is given twice, or has a value that the core cannot evaluate.
        """
        names = ("xx", "yy", "xy") if dim == 2 else ("xx", "yy", "zz", "xy", "xz", "yz")
        stress = self.stress if isinstance(self.stress, dict) or self.stress is None else dict.fromkeys(names[:dim], self.stress)
        given = []
        for what, of in (("rate", self.rate), ("stress", stress)):
            if of is not None and not isinstance(of, dict):
                raise ValueError(f"{what} of the periodic cell is {of!r}: give {{component: value}}, of {', '.join(names)}")
            found = {}
            for name, value in (of or {}).items():
                if name not in names:
                    raise ValueError(f"{what} of the periodic cell names {name!r}: give {listed(names, name)}")
                texts = None if isinstance(value, str) else texts_of(value)
                if texts is None or len(texts) != 1:
                    due = "give a finite number, cairn.Table, Harmonic or Expression"
                    raise ValueError(f"{what}[{name!r}] of the periodic cell is {value!r}: {due}")
                found[name] = texts[0]
            given.append(found)
        twice = sorted(set(given[0]) & set(given[1]))
        if self.shear_rate and names[-1 if dim == 2 else 4] in {*given[0], *given[1]}:
            twice.append(names[-1 if dim == 2 else 4])
        if twice:
            raise ValueError(f"component {twice[0]} of the periodic cell has two of rate, stress and shear_rate: give one")
        return tuple(given)

    def arrays(self, dim):
        """Gives the cell as the core takes it.

        Parameters
        ----------
        dim : int
            2 or 3.

        Returns
        -------
        tuple
            Whether each axis is periodic (3,), vectors (3, 3) by rows [m], corner (3,) [m], velocity gradient (3, 3) [1/s].

        Raises
        ------
        ValueError
            If there is not a length >= 0 for each axis, or a cell shears along an axis that is not periodic.
        """
        if isinstance(self.lengths, (tuple, list)) and None in self.lengths:
            raise ValueError(f"lengths of the periodic cell is {self.lengths}: give inf or 0 along axes that are not periodic")
        lengths = checks.reals("lengths of the periodic cell", self.lengths)
        if lengths.shape != (dim,) or np.any(np.isnan(lengths)) or np.any(lengths < 0):
            raise ValueError(f"lengths of the periodic cell is {self.lengths}: give {dim} lengths >= 0, inf or 0 where it is not")
        periodic = np.zeros(3, bool)
        periodic[:dim] = np.isfinite(lengths) & (lengths > 0)
        vectors, corner, gradient = np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3))
        vectors[range(dim), range(dim)] = np.where(periodic[:dim], lengths, 0.0)
        if self.corner is not None:
            corner[:dim] = checks.real_array("corner", self.corner, (dim,))
        if self.shear_rate or self.lean:
            if not (periodic[0] and periodic[dim - 1]):
                raise ValueError("shear_rate and lean need a cell that is periodic along its first and its last axis")
            vectors[dim - 1, 0] = checks.number("lean", self.lean)
            gradient[0, dim - 1] = checks.number("shear_rate", self.shear_rate)
        return periodic, vectors, corner, gradient
