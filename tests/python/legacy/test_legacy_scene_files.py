"""Scenes that `cairn convert` writes of LMGC90 folders with meshes: they are read again, and run to the same bits."""

import os
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn.cli import main
from cairn.legacy import read_datbox

FOLDERS = Path(os.environ.get("CAIRN_REFERENCE_DATA", "")) / "legacy"


def nodes_after(scene, steps):
    sim = cn.Simulation(scene, 1e-4, cn.NSCD(theta=0.5), overlap="ignore")
    sim.run(steps, progress=False)
    return np.array(sim.nodes.position), np.array(sim.nodes.velocity)


@pytest.mark.skipif("CAIRN_REFERENCE_DATA" not in os.environ, reason="needs the folders of LMGC90 (CAIRN_REFERENCE_DATA)")
@pytest.mark.parametrize("name", ["mesh3d_cubes", "mesh2d_clalp"])
def test_a_converted_folder_runs_as_the_folder_itself(name, tmp_path):
    file = tmp_path / "a.scene.h5"
    assert main(["convert", str(FOLDERS / name), str(file)]) == 0
    one, other = nodes_after(read_datbox(FOLDERS / name), 5), nodes_after(cn.Scene.load(file), 5)
    for a, b in zip(one, other):
        assert np.array_equal(a, b)
    assert np.any(one[1] != 0)


@pytest.mark.parametrize("given", [[], [cn.Material("m", density=1.0)]])
def test_lists_of_materials_come_back_from_scene_files_as_lists(given):
    from cairn.model.mesh_files import decoded, encoded

    assert decoded(encoded({"edge_material": given})) == {"edge_material": given}
