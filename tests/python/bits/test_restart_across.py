"""A checkpoint of one language restarts in the others, where the scene is the same: C and Fortran make the same calls."""

import cairn as cn
import pytest
from small_scenes import differing, heap, state


def simulation(**options):
    return cn.Simulation(heap(2, **options), 2e-3, overlap="ignore")


def steps(sim, many):
    for _ in range(many):
        sim.step()
    return sim


def test_a_checkpoint_of_a_program_restarts_in_python(tmp_path):
    path, one = str(tmp_path / "a.checkpoint.h5"), steps(simulation(), 20)
    one._core.write_checkpoint(one._core_scene, len(one._species), path)
    other = simulation()
    other.restore(path)
    assert not differing(state(one), state(other))
    assert not differing(state(steps(one, 20)), state(steps(other, 20)))


def test_a_checkpoint_of_python_restarts_in_a_program(tmp_path):
    path, one, other = tmp_path / "a.checkpoint.h5", steps(simulation(), 20), simulation()
    one.checkpoint(path)
    other._core.restart(other._core_scene, len(other._species), str(path))
    assert not differing(state(steps(one, 20)), state(steps(other, 20)))


def test_that_of_another_scene_is_refused_and_nothing_has_changed(tmp_path):
    path, one, other = str(tmp_path / "a.checkpoint.h5"), simulation(), steps(simulation(counts=(7, 6)), 2)
    one._core.write_checkpoint(one._core_scene, len(one._species), path)
    before = state(other)
    with pytest.raises(cn.FileError, match="belongs to another scene"):
        other.restore(path)
    with pytest.raises(cn.FileError, match="belongs to another scene"):
        other._core.restart(other._core_scene, len(other._species), path)
    assert not differing(before, state(other))
