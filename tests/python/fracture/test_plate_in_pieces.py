"""A plate of several known pieces that breaks in a run: `cn.post.fragments` finds these, and no other."""

import cairn as cn
import numpy as np
import pytest

SIDE = 0.1
MAP = ["aaabbb", "aaccbb", "ddcccb", "ddddee"]  # of the blocks of a plate, from the top


def plate(law):
    """Blocks in a plate, each of the material of its piece; pieces fly off from the middle."""
    names = np.array([list(row) for row in MAP[::-1]])
    place = np.stack(np.meshgrid(np.arange(6), np.arange(4)), -1).reshape(-1, 2) * SIDE
    names = names.ravel()
    pieces = {name: np.flatnonzero(names == name) for name in np.unique(names)}
    square = np.array([(0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE)])
    scene, ids, middle = cn.Scene(2), {}, place.mean(axis=0)
    for k, (name, blocks) in enumerate(pieces.items()):
        away = 0.5 * (place[blocks].mean(axis=0) - middle)
        material = cn.Material(name, density=1000.0 + 100.0 * k)
        ids[name] = scene.add(cn.polygons([square + place[b] for b in blocks], material, velocity=(*away, 0.0)))
        scene.interact(name, name, law(1e9))
    for a in pieces:
        for b in pieces:
            if a < b:
                scene.interact(a, b, law(1e3))
    return scene, ids



def zone(strength, stiffness=1e12):
    work = strength * 1e-6 + strength**2 / stiffness  # more than twice the energy stored at the strength
    return cn.MAL(normal_stiffness=stiffness, tangential_stiffness=stiffness, mu=0.3, normal_strength=strength,
                  tangential_strength=strength, normal_work=work, tangential_work=work)  # fmt: skip


LAWS = {"MohrCoulomb": lambda strength: cn.MohrCoulomb(tension=strength, cohesion=strength, mu=0.3), "MAL": zone}


@pytest.mark.parametrize("name", LAWS)
def test_a_plate_breaks_into_the_pieces_that_it_is_made_of(name, tmp_path):
    scene, ids = plate(LAWS[name])
    sim = cn.Simulation(scene, 1e-4, cn.NSCD(solver=cn.NLGS(tol=1e-8, max_iter=20000)), overlap="ignore")
    # as it is made all of it is one
    whole = cn.Simulation(plate(lambda strength: LAWS[name](1e9))[0], 1e-4, cn.NSCD(solver=cn.NLGS(tol=1e-6, max_iter=20000)))
    whole.step()
    assert [len(piece) for piece in cn.post.fragments(whole)] == [24]
    sim.run(steps=60, output=tmp_path / "plate.vtkhdf", every=20, progress=False)
    wanted = sorted((np.sort(list(i)) for i in ids.values()), key=lambda piece: (-len(piece), piece[0]))
    for state in (sim, cn.load(tmp_path / "plate.vtkhdf")[-1]):
        found = cn.post.fragments(state)
        assert [piece.tolist() for piece in found] == [piece.tolist() for piece in wanted]
    mass = {name: (1000.0 + 100.0 * k) * SIDE**2 * len(blocks) for k, (name, blocks) in enumerate(ids.items())}
    of = dict(zip(sim.bodies.id.tolist(), sim.bodies.mass))
    found = {tuple(piece.tolist()): sum(of[i] for i in piece.tolist()) for piece in cn.post.fragments(sim)}
    for name, blocks in ids.items():
        assert found[tuple(np.sort(list(blocks)).tolist())] == pytest.approx(mass[name], rel=1e-12)
    for blocks in ids.values():  # each flies as one
        rows = np.isin(sim.bodies.id, list(blocks))
        assert np.abs(np.ptp(sim.bodies.velocity[rows, 2])) < 1e-4 * np.abs(sim.bodies.velocity).max()
