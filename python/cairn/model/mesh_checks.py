"""Checks of what a deformable body is given, with errors that name the field, the value and the remedy."""

from __future__ import annotations

from ..base import checks
from .mesh_parts import group_nodes

GROUPED = {"fixed": '{group: "xy"}', "drive": '{group: {"x": velocity}}', "displace": '{group: {"x": function of time}}',
           "pressure": "{group: p}"}  # fmt: skip
BY_AXIS = {"drive": '{axis: velocity}, such as {"x": 0.1}', "displace": '{axis: function of time}, such as {"x": cn.Table(...)}'}


def checked_fields(dim, given, fixed, drive):
    """Copies of fixed and drive. Raises ValueError for fields that are no dicts of groups, for axes that are none, and for
    functions that take no time."""
    for field, due in GROUPED.items():
        if given[field] is not None and not isinstance(given[field], dict):
            raise ValueError(f"{field} is {given[field]!r}: give {due}")
    for field, due in BY_AXIS.items():
        for group, of in (given[field] or {}).items():
            if not isinstance(of, dict):
                raise ValueError(f"{field} of {group!r} is {of!r}: give {due}")
    _check_force(dim, given["force"])
    for group, axes in (fixed or {}).items():
        checks.fixed_axes(group, axes, dim)
    _check_functions(**{name: given[name] for name in ("force", "body_force", "drive", "displace", "pressure", "traction")})
    return dict(fixed or {}), dict(drive or {})


def _check_force(dim, force):
    """Raises ValueError for a force that is neither {group: (dim,) or a function of time} nor a function of time."""
    if force is None or callable(force):
        return
    if not isinstance(force, dict):
        due = f"give {{group: ({dim},)}} [N], a function of time in the place of ({dim},) where it changes"
        raise ValueError(f"force is {force!r}: {due}")
    for group, total in force.items():
        if not callable(total):
            checks.real_array(f"force of {group!r}", total, (dim,))


def _check_functions(**fields):
    """Raises ValueError for a function of time that takes no time, wherever in a field it stands."""
    for name, value in fields.items():
        for place, of in value.items() if isinstance(value, dict) else [("", value)]:
            for axis, function in of.items() if isinstance(of, dict) else [("", of)]:
                if callable(function) and not getattr(function, "needs_simulation", False):
                    checks.function_of_time("".join([name, *(f"[{key!r}]" for key in (place, axis) if key)]), function)


def checked_mortar(wanted, dim, nodes, pairs, patches):
    """Checks that mortar contact has nodes and sides.

    Parameters
    ----------
    wanted : bool
        True for mortar contact.
    dim : int
        2 or 3.
    nodes : ndarray
        Contact nodes.
    pairs : ndarray (m, 2)
        Edges.
    patches : Faces or None
        Faces.

    Returns
    -------
    bool
        True if contact is enforced by dual mortar multipliers.

    Raises
    ------
    ValueError
        If it is wanted without contact nodes or sides.
    """
    if wanted and (not len(nodes) or not (len(pairs) if dim == 2 else patches)):
        sides = "edges" if dim == 2 else "faces"
        raise ValueError(f"mortar is of contact nodes and the {sides} between them: give contact and {sides} of that side")
    return bool(wanted)


def checked_modal_damping(ratios, body, rigid):
    """Checks damping ratios of the modes of a body.

    Parameters
    ----------
    ratios : float, sequence of float or None
        Damping ratios [-].
    body : LinearBody or ElasticBody
        The body.
    rigid : list of str
        Its rigid parts.

    Returns
    -------
    float, ndarray or None
        The ratios; None without any.

    Raises
    ------
    ValueError
        If the body is not linear or has rigid parts.
    """
    if ratios is None:
        return None
    from .modal_damping import checked

    if rigid:
        raise ValueError("modal_damping needs a body without rigid parts: leave `rigid` out, or give the body rayleigh=(a, b)")
    return checked(ratios, body)


def checked_self_contact(wanted, nodes, between, pairs, patches):
    """Checks that self-contact has points and sides.

    Parameters
    ----------
    wanted : bool
        True for self-contact.
    nodes : ndarray
        Contact nodes.
    between : ndarray
        Nodes of points between nodes.
    pairs : ndarray (m, 2)
        Edges.
    patches : Faces or None
        Faces.

    Returns
    -------
    bool
        True for self-contact.

    Raises
    ------
    ValueError
        If it is wanted without points or without sides.
    """
    if wanted and not ((len(nodes) or len(between)) and (len(pairs) or patches)):
        raise ValueError("self_contact is of points and sides of one mesh: give contact (or points), and edges or faces")
    return bool(wanted)


def checked_displacements(body, displace, drive):
    """Checks imposed displacements.

    Parameters
    ----------
    body : ElasticBody, LinearBody or CallbackBody
        The body.
    displace : dict or None
        {group: {axis: function of time}} [m].
    drive : dict
        {group: {axis: velocity}} [m/s].

    Returns
    -------
    dict
        {group: {axis: function of time}}.

    Raises
    ------
    ValueError
        If a dof is imposed twice, or a displacement is no function of time.
    """
    out, taken = dict(displace or {}), {}
    for what, of in (("drive", drive), ("displace", out)):
        for group, by_axis in of.items():
            for axis, value in by_axis.items():
                if what == "displace" and not callable(value):
                    remedy = "give a function of time, such as cn.Table; `fixed` holds a group where it is"
                    raise ValueError(f"displace of {group!r} along {axis} is {value!r}: {remedy}")
                if not callable(value):
                    checks.number(f"drive of {group!r} along {axis}", value)
                for dof in (body.dim * group_nodes(body, group) + checks.axis(f"{what} of {group!r}", axis, body.dim)).tolist():
                    if what == "displace" and dof in taken:
                        named = f"node {dof // body.dim} along {axis}"
                        raise ValueError(f"displace of {group!r} moves {named}, which is moved already: leave it out of one")
                    if what == "drive" and taken.setdefault(dof, value) != value:
                        named = f"node {dof // body.dim} along {axis} at {value!r}, which another group drives at {taken[dof]!r}"
                        raise ValueError(f"drive of {group!r} drives {named}: leave it out of one")
                    taken[dof] = value
    return out
