"""Small forms of benchmarks/fluid_cases.py, each with a gate: drag in an array of spheres, force on a wedge, a dam break."""

import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).resolve().parents[3] / "benchmarks"
pytestmark = pytest.mark.skipif(not BENCHMARKS.exists(), reason="benchmarks are not there")


@pytest.fixture(scope="module")
def cases():
    """The module of the cases; modules beside it are imported by it."""
    sys.path.insert(0, str(BENCHMARKS))
    try:
        import fluid_cases

        yield fluid_cases
    finally:
        sys.path.remove(str(BENCHMARKS))


@pytest.mark.parametrize(("form", "gate"), [({}, 0.2), ({"incompressible": True}, 0.14)])
def test_drag_of_an_array_of_spheres(cases, form, gate):
    # Hasimoto (1959), 2.7 spacings a radius: first order, 13 and 9 % at 3.7
    errors, _, _ = cases.bodies.hasimoto(1 / 12, **form)
    assert errors["K at 0.05"] < gate


@pytest.mark.filterwarnings("ignore:.*gaps under its spacing")
@pytest.mark.parametrize("form", [{}, {"incompressible": True}])
def test_force_on_a_wedge_that_enters_water(cases, form):
    # Zhao & Faltinsen (1993), 30 degrees; the middle of the tank is a wall beside the wedge
    errors, _, _ = cases.bodies.wedge(0.05 if form else 0.025, **form)
    assert errors["force, 30 degrees"] < (0.25 if form else 0.08)


def test_the_implicit_step_breaks_a_dam_to_the_same_error_in_a_tenth_of_the_steps(cases):
    (explicit, _, work), (implicit, _, steps) = cases.dam_break(0.1), cases.dam_break(0.1, incompressible=True)
    for name, error in explicit.items():  # ahead of experiments: without friction
        assert 0 < error < 0.11 and abs(implicit[name] - error) < 0.03
    assert steps < 0.1 * work


def test_rows_stand_beside_those_of_other_cases(cases, tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    case = lambda dx: ({"error": dx**2}, 1.0, 100)  # noqa: E731
    monkeypatch.setattr(cases, "CASES", {"b": (case, (0.2, 0.1, 0.05)), "a": (case, (0.2, 0.1, 0.05))})
    for names in (["a"], ["b", "--full"]):
        monkeypatch.setattr(sys, "argv", ["fluid_cases.py", *names, "--output", str(path)])
        cases.main()
    rows = [line.split(",") for line in path.read_text().splitlines()[1:]]
    assert [row[0] for row in rows] == ["b"] * 3 + ["a"] * 2 and rows[1][4] == "2.00"
    monkeypatch.setattr(sys, "argv", ["fluid_cases.py", "c"])
    with pytest.raises(SystemExit):
        cases.main()
