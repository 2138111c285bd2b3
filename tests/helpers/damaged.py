"""Damage that a seal does not tell: contents of checkpoints and scenes with one value, size, type or name
changed, sealed again."""

import copy

import numpy as np


def leaves(tree, place=()):
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from leaves(value, (*place, name))
        else:
            yield (*place, name)


def damaged(content, chance):
    """(description of the damage, damaged content): a leaf of the nested dict is changed. chance: random.Random."""
    content = copy.deepcopy(content)
    place = chance.choice(list(leaves(content)))
    holder = content
    for name in place[:-1]:
        holder = holder[name]
    name, value = place[-1], holder[place[-1]]
    how = chance.choice(["gone", "other type", *(["value"] * 6), *(["size"] * 2)])
    if how == "gone":
        del holder[name]
    elif how == "other type":
        holder[name] = chance.choice(["word", -1, np.zeros(3), None, {"a": 1}, [1, "x"]])
    elif isinstance(value, np.ndarray) and value.size:
        flat = value.ravel().copy()
        if how == "value":
            odd = [-1, 2**31 - 1, 7, 0] if flat.dtype.kind in "iu" else [-1.0, np.nan, np.inf, 1e300, 0.0, -1e-30]
            low, high = (np.iinfo(flat.dtype).min, np.iinfo(flat.dtype).max) if flat.dtype.kind in "iu" else (-np.inf, np.inf)
            new = chance.choice(odd)
            flat[chance.randrange(flat.size)] = min(max(new, low), high) if new == new else new
            holder[name] = flat.reshape(value.shape)
        else:
            holder[name] = chance.choice([flat[:-1], np.concatenate([flat, flat[:1]]), flat[:0], np.tile(flat, 3)])
    elif isinstance(value, str):
        holder[name] = chance.choice(["", "servo", "disk", "polyhedron", value * 3])
    else:
        holder[name] = chance.choice([-1, 10**12, 0.5, "word", None])
    return ".".join(place) + f" ({how})", content
