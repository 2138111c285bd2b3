"""Contacts of equilibrium problems: those with a normal that rounding does not change, and their slack."""

from __future__ import annotations

import numpy as np

from .. import _core


def slack_of(u, mu):
    """u (m, dim) with mu |u_T| added along the normal (De Saxce & Feng 1998)."""
    return np.concatenate((u[:, :1] + (mu * np.linalg.norm(u[:, 1:], axis=1))[:, None], u[:, 1:]), axis=1)


def determined(simulation, rows):
    """True for contacts (m,) with a well-defined normal, insensitive to rounding of positions: those of meshes, of round bodies,
    and of pairs that touch on a face."""
    contactors, contacts = simulation.contactors, simulation.contacts
    faced = np.unique(contactors.body[np.isin(contactors.shape, _core.shapes("faced"))])
    flat = np.isin(contacts.bodies, faced).all(axis=1)
    of_meshes = np.zeros(len(flat), bool) if rows.mesh is None else (rows.mesh >= 0).any(axis=1)
    return of_meshes | ~flat | on_faces(contacts)


def refuse_springs(rows, chosen):
    if rows.compliance[chosen].any():
        raise ValueError(
            "contacts give way as springs do (ElasticContact, CriticalVoigt, AdhesiveContact with a stiffness, say): they bear "
            "a load where bodies have moved alone; let the scene settle, or give UnilateralContact or Coulomb"
        )


def on_faces(contacts, flat=1e-6):
    """True for contacts (m,) of pairs of bodies that touch on a face, not at a corner or along an edge alone. flat: least ratio
    of the two extents of the contact points in 3D."""
    point = np.asarray(contacts.point)
    dim = point.shape[1]
    pairs, which = np.unique(np.sort(contacts.bodies, axis=1), axis=0, return_inverse=True)
    which = which.ravel()
    count = np.bincount(which)
    middle = np.stack([np.bincount(which, x) for x in point.T], axis=1) / count[:, None]
    arm = point - middle[which]
    spread = np.stack([np.bincount(which, arm[:, i] * arm[:, j]) for i in range(dim) for j in range(dim)], axis=1)
    size = np.sqrt(np.maximum(np.linalg.eigvalsh(spread.reshape(-1, dim, dim)), 0))  # along the axes, smallest first
    face = size[:, 1] > flat * size[:, -1] if dim == 3 else size[:, 1] > 0
    return face[which]
