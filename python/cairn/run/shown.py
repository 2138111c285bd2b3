"""Read-only copies of arrays of a simulation: writing raises an error that says how to set the quantity instead."""

from __future__ import annotations

import numpy as np


class Shown(np.ndarray):
    """A copy of an array of a simulation that refuses assignments, since these would not change the simulation.

    Results computed from it, such as `copy()`, are plain arrays. Its memory is writable, because some libraries that only read
    require it (scipy's rotations); the class refuses assignments instead.
    """

    remedy, fixed = "", False

    def __array_finalize__(self, source):
        self.remedy = getattr(source, "remedy", "")
        self.fixed = getattr(source, "fixed", False) and np.may_share_memory(self, source)  # else it is a copy of a part

    def _refuse(self):
        if self.fixed:
            raise ValueError(f"this array is a copy, and writing into it changes nothing: {self.remedy}")

    def __setitem__(self, index, value):
        self._refuse()
        super().__setitem__(index, value)

    def __array_ufunc__(self, ufunc, method, *inputs, out=None, **options):
        if out is not None:
            for array in out:
                if isinstance(array, Shown):
                    array._refuse()
            options["out"] = tuple(map(_plain, out))
        if method == "at" and isinstance(inputs[0], Shown):
            inputs[0]._refuse()
        return getattr(ufunc, method)(*map(_plain, inputs), **options)

    def __array_function__(self, function, types, inputs, options):
        if function in _WRITERS and inputs and isinstance(inputs[0], Shown):
            inputs[0]._refuse()
        return super().__array_function__(function, types, inputs, options)

    def copy(self, order="C"):
        """A writable copy, a plain array."""
        return _plain(self).copy(order)

    def __repr__(self):
        return repr(_plain(self))

    def __reduce__(self):
        return _plain(self).copy().__reduce__()


_WRITERS = {np.copyto, np.place, np.putmask, np.put, np.fill_diagonal, np.put_along_axis}


def _refusing(name):
    """Wraps a method of ndarray that writes in place, so that it refuses read-only copies."""

    def method(self, *given, **named):
        self._refuse()
        return getattr(np.ndarray, name)(self, *given, **named)

    return method


for _name in ("fill", "sort", "partition", "put", "resize", "setfield"):
    setattr(Shown, _name, _refusing(_name))


def _plain(array):
    return array.view(np.ndarray) if isinstance(array, Shown) else array


def shown(values, remedy):
    """The array as a Shown. remedy: text of the error on assignment."""
    out = values.view(Shown)
    out.remedy, out.fixed = remedy, True
    return out
