"""Script for Blender: a run of rigid bodies, written by `cairn convert run.vtkhdf run.npz`, as animated objects.

blender --python blender_import.py -- run.npz [outputs a second, 24]

It runs in Blender's own Python, which has numpy but neither Cairn nor h5py. Each body is a mesh with key frames of its place and
rotation, coloured by its material. `python -m cairn.post.blender_import` prints where this file is.
"""

import sys

import numpy as np


def quaternions(rotation):
    """Rotations (n,) [rad] in 2D or (n, 4) as unit quaternions (n, 4), w first."""
    rotation = np.asarray(rotation, float)
    if rotation.ndim == 2 and rotation.shape[1] == 4:
        return rotation
    half = rotation.reshape(len(rotation), -1)[:, 0] / 2
    return np.column_stack((np.cos(half), np.zeros((len(half), 2)), np.sin(half)))


def turned_back(q, v):
    """Vectors (m, 3) turned by the inverse of a unit quaternion."""
    w, u = q[0], -q[1:]
    t = 2 * np.cross(u, v)
    return v + w * t + np.cross(u, t)


def bodies_of(data):
    """Surfaces {id: (points (p, 3) from the centre in the axes of the body, triangles (t, 3))} of the first output."""
    points, triangles, owner = data["surfaces/points"], data["surfaces/triangles"], data["surfaces/id"]
    ids, place = data["00000/bodies/id"], three(data["00000/bodies/position"])
    turn = (
        quaternions(data["00000/bodies/rotation"]) if "00000/bodies/rotation" in data else np.tile([1.0, 0, 0, 0], (len(ids), 1))
    )
    out = {}
    for number, x, q in zip(ids.tolist(), place, turn):
        mine = triangles[owner == number]
        if len(mine):
            used, corners = np.unique(mine, return_inverse=True)
            out[number] = turned_back(q, points[used] - x), corners.reshape(-1, 3)
    return out


def three(positions):
    """Positions (n, 2 | 3) as (n, 3)."""
    return np.column_stack((positions, np.zeros((len(positions), 3 - positions.shape[1]))))


def build(bpy, data, rate=24.0):
    """Makes the objects, their materials and key frames; gives the objects by id."""
    objects, materials = {}, {}
    kinds = dict(zip(data["00000/bodies/id"].tolist(), data["00000/bodies/material"].tolist()))
    for number, (points, triangles) in bodies_of(data).items():
        mesh = bpy.data.meshes.new(f"body {number}")
        mesh.from_pydata(points.tolist(), [], triangles.tolist())
        body = objects[number] = bpy.data.objects.new(f"body {number}", mesh)
        body.rotation_mode = "QUATERNION"
        kind = kinds[number]
        if kind not in materials:
            materials[kind] = bpy.data.materials.new(f"material {kind}")
            golden = (0.1 + 0.618034 * kind) % 1.0
            materials[kind].diffuse_color = (0.3 + 0.5 * golden, 0.45, 0.8 - 0.5 * golden, 1.0)
        mesh.materials.append(materials[kind])
        bpy.context.collection.objects.link(body)
    times = data["time"]
    frames = np.round((times - times[0]) * rate).astype(int) + 1
    for k, frame in enumerate(frames.tolist()):
        name = f"{k:05d}/bodies/"
        place = three(data[name + "position"])
        turn = quaternions(data[name + "rotation"]) if name + "rotation" in data else None
        for row, number in enumerate(data[name + "id"].tolist()):
            if number in objects:
                objects[number].location = place[row].tolist()
                objects[number].keyframe_insert("location", frame=frame)
                if turn is not None:
                    objects[number].rotation_quaternion = turn[row].tolist()
                    objects[number].keyframe_insert("rotation_quaternion", frame=frame)
    bpy.context.scene.frame_end = int(frames[-1])
    return objects


def main(arguments):
    """Reads the file that stands after `--`."""
    if not arguments:
        raise SystemExit("give the file: blender --python blender_import.py -- run.npz [outputs a second]")
    import bpy

    data = np.load(arguments[0])
    if "surfaces/points" not in data:
        raise SystemExit(f"{arguments[0]} holds no surfaces: write it by `cairn convert run.vtkhdf run.npz`, all outputs")
    build(bpy, data, float(arguments[1]) if len(arguments) > 1 else 24.0)


if __name__ == "__main__":
    if "--" in sys.argv:
        main(sys.argv[sys.argv.index("--") + 1 :])
    else:
        print(__file__)
