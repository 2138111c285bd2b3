"""Callback of GrainLearning: parameters found again, and runs that fail as a status."""

import contextlib
import io
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from cairn import study
from cairn.base.errors import FileError

SCRIPT = """
import cairn as cn
from slope import TILT


def run(parameters):
    if parameters["mu"] > 0.52:
        raise ValueError("too rough")
    rock = cn.Material("rock", density=2000.0)
    scene = cn.Scene(2, gravity=(9.81 * TILT, -9.81))
    scene.add(cn.polygons([[[-0.2, 0.0], [0.2, 0.0], [0.2, 0.1], [-0.2, 0.1]]], rock), cn.wall((0, 0), (0, 1), rock))
    scene.interact(rock, rock, cn.Coulomb(mu=parameters["mu"]))
    sim = cn.Simulation(scene, 5e-3)
    way = []
    for k in range(30):
        sim.step()
        if k % 10 == 9:
            way.append(sim.bodies.position[0, 0])
    return {"way": way}
"""
TIMES = 0.05 * np.arange(1, 4)
SEEN = 0.5 * 9.81 * (0.7 - 0.3) * TIMES**2  # a block that slides with mu 0.3


@pytest.fixture
def script(tmp_path):
    (tmp_path / "slope.py").write_text("TILT = 0.7\n")
    path = tmp_path / "block.py"
    path.write_text(SCRIPT)
    return path


def system_of(samples, names=("way",)):
    """The part of a grainlearning.DynamicSystem that the callback reads."""
    system = SimpleNamespace(
        param_names=["mu"], param_data=np.reshape(samples, (-1, 1)), obs_names=list(names), obs_data=SEEN[None], num_steps=3
    )
    system.set_sim_data = lambda data: setattr(system, "sim_data", np.array(data))
    return SimpleNamespace(system=system)


def test_samples_that_fail_have_no_weight(script):
    callback, calibration = study.GrainLearning(script, processes=1), system_of([0.3, 0.55])
    with pytest.warns(
        UserWarning, match=r"1 of 2 samples failed, sample 1 with \{'mu': 0.55\}: ValueError: too rough; they have"
    ):
        callback(calibration)
    assert callback.failed == [{1: "ValueError: too rough"}]
    assert calibration.system.sim_data.shape == (2, 1, 3)
    assert calibration.system.sim_data[0, 0] == pytest.approx(SEEN, rel=0.1)
    assert calibration.system.sim_data[1].min() > 1e5 * SEEN.max()


@pytest.mark.parametrize(
    "body, told",
    [
        ("raise ValueError('no')", "2 of 2 samples failed, sample 0 .*ValueError: no"),
        ("return {'other': 1.0}", "run returned no 'way'"),
        ("return {'way': [1.0, 2.0]}", r"'way' has shape \(2,\): give a number, or \(3,\)"),
        ("return {'way': float('nan')}", "'way' is not finite"),
        ("return 3", "run returned no 'way'"),
        ("import os; os._exit(3)", "the process ended"),
    ],
)
def test_where_all_fail_the_reason_is_told(tmp_path, body, told):
    path = tmp_path / "bad.py"
    path.write_text(f"def run(parameters):\n    {body}\n")
    with pytest.raises(study.CalibrationError, match=told):
        study.GrainLearning(path, processes=1)(system_of([0.1, 0.2]))


def test_wrong_settings_are_refused(script, tmp_path):
    with pytest.raises(FileError, match="no such script"):
        study.GrainLearning(tmp_path / "nothing.py")
    calibration = system_of([0.3])
    calibration.system.obs_names = None
    with pytest.raises(study.CalibrationError, match="no param_names or no obs_names"):
        study.GrainLearning(script)(calibration)


def test_grainlearning_finds_mu_beside_runs_that_fail(script):
    grainlearning = pytest.importorskip("grainlearning", reason="grainlearning is not installed")
    callback = study.GrainLearning(script, processes=1)
    calibration = grainlearning.BayesianCalibration.from_dict({
        "num_iter": 3,
        "callback": callback,
        "system": {
            "system_type": grainlearning.DynamicSystem,
            "param_names": ["mu"],
            "param_min": [0.05],
            "param_max": [0.6],
            "num_samples": 8,
            "obs_names": ["way"],
            "obs_data": SEEN[None],
            "ctrl_data": TIMES,
            "sim_name": "block",
            "sigma_tol": 1e-4,
        },
        "inference": {"Bayes_filter": {"ess_target": 0.3}, "sampling": {"max_num_components": 1}},
        "save_fig": -1,
    })  # fmt: skip
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        calibration.run()
    assert callback.failed[0] and all("too rough" in why for why in callback.failed[0].values())
    assert calibration.system.estimated_params[-1, 0] == pytest.approx(0.3, abs=0.03)
