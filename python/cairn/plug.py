"""Routines from users' shared libraries, written in Fortran, C or whatever makes a library with C names."""

from __future__ import annotations

import os

from . import _core, laws


def plug(library, *, law, params=None, replace=False, thread_safe=True):
    """A contact law from a shared library, which describes it by `cairn_describe_NAME` (cairn/plug.h, module cairn_plug).

    library: path of the library. law: NAME. params: its values in the order of the descriptor, or a dict; the law is then
    returned with these, ready for Scene.interact. Without params its class is returned: `Mine = plug("libmine.so", law="mine")`,
    `Mine(mu=0.4)`. replace: take the place of the law of that name, a built-in one too, in all simulations from now on.
    thread_safe=False: the law is never called by two threads at once, whatever its descriptor says.

    Raises ValueError when the library or its descriptor is missing or does not fit this Cairn, naming what and the remedy.
    """
    if not isinstance(law, str) or not law:
        raise ValueError(f"law is {law!r}: give the name that the library describes")
    path = os.fspath(library)
    if os.path.exists(path):
        path = os.path.abspath(path)
    elif os.sep in path:
        raise ValueError(f"{path}: there is no such file; build the library first")
    found = laws.plugged_class(*_core.plug_law(path, law, bool(replace), not thread_safe))
    if params is None:
        return found
    if isinstance(params, dict):
        return found(**params)
    params = list(params)
    names = found.parameter_names
    if len(params) != len(names):
        raise ValueError(
            f"params has {len(params)} values and {law} takes {len(names)}: {', '.join(names) or 'none'}; give them in this order"
        )
    return found(**dict(zip(names, params)))
