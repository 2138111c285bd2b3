"""Wavefront's OBJ: corners, faces, and the names of objects and groups."""

from __future__ import annotations

import re

import numpy as np


def read_objects(path):
    """(vertices (n, 3), [(name, faces)]) of an OBJ file, faces a list of the corners of each: one entry for each object (o), or
    each group (g) where no object is named; the name is "" before the first. Raises ValueError that names the line."""
    vertices, objects, groups = [], {"": []}, {"": []}
    in_object, in_group, held = "", "", ""
    for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
        line, held = held + line, ""
        if line.endswith("\\"):
            held = line[:-1] + " "
            continue
        kind, *words = line.split("#")[0].split() or [""]
        try:
            if kind == "v":
                x, y, z = map(float, words[:3])
                vertices.append((x, y, z))
            elif kind == "f":
                loop = [_corner(word, len(vertices)) for word in words]
                if len(loop) < 3:
                    raise ValueError(f"a face of {len(loop)} corners")
                objects[in_object].append(loop)
                groups[in_group].append(loop)
            elif kind == "o":
                in_object = " ".join(words)
                objects.setdefault(in_object, [])
            elif kind == "g":
                in_group = " ".join(words)
                groups.setdefault(in_group, [])
        except ValueError as error:
            raise ValueError(f"{path.name}, line {number}, {line.strip()[:60]!r}: {error}") from None
    named = objects if any(name and faces for name, faces in objects.items()) else groups
    found = [(name, faces) for name, faces in named.items() if faces]
    return np.array(vertices, float).reshape(-1, 3), found


def _corner(word, count):
    """The number of a corner of a face, from 0; negative ones count from the last vertex."""
    number = int(word.split("/")[0])
    if number == 0 or number > count or number < -count:
        raise ValueError(f"there is no vertex {number} yet: {count} came before")
    return number - 1 if number > 0 else count + number


def kind_of(name):
    """Kind of an object: its name without the trailing number, Stone of Stone.012."""
    bare = re.sub(r"[\s._-]*\d+$", "", name).strip()
    return bare or name
