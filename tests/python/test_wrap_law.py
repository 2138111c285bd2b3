"""Scalar routines of another time as contact laws: COMMON data, prints and STOP among them."""

import shutil
import subprocess
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn.plugs.wrap_law import wrap_law
from test_plug import heap

pytestmark = pytest.mark.skipif(not shutil.which("gfortran") or not shutil.which("gcc"), reason="no compilers")

# Coulomb's law in 2D, as an old code has it: fixed form, COMMON, prints, STOP.
SOLVE = """
      SUBROUTINE OLDLAW(UN, UT, WN, WT, FRIC, RN, RT, IST)
      DOUBLE PRECISION UN, UT, WN, WT, FRIC, RN, RT
      INTEGER IST, NCALL
      COMMON /COUNT/ NCALL
      SAVE /COUNT/
      NCALL = NCALL + 1
      IF (FRIC .GT. 0.9D0 .AND. NCALL .GT. 3) THEN
        PRINT *, 'FRICTION OUT OF TABLE', FRIC
        STOP 'OLDLAW GIVES UP'
      END IF
      RN = MAX(0.D0, -UN/WN)
      RT = -UT/WT
      IST = 1
      IF (ABS(RT) .GT. FRIC*RN) THEN
        RT = SIGN(FRIC*RN, RT)
        IST = 2
      END IF
      IF (RN .LE. 0.D0) IST = 0
      END
"""
PREPARE = """
      SUBROUTINE OLDGAP(G, H, FRIC, B, F)
      DOUBLE PRECISION G, H, FRIC, B, F
      B = MAX(G, 0.D0)/H
      F = FRIC
      IF (FRIC .GT. 0.9D0) STOP 7
      END
"""
INTERFACES = {
    "solve": 'name="{n}"\nroutine="OLDLAW"\nslot="solve"\nsources=["old.f"]\nparameters="fric::0:inf"\ncomponents=[2, 0]\n'
    'arguments=["u1", "u2", "w11", "w22", "fric", "r1", "r2", "status:int"]\n',
    "prepare": 'name="{n}"\nroutine="OLDGAP"\nslot="prepare"\nsources=["old.f"]\nparameters="fric::0:inf"\ncomponents=[2, 3]\n'
    'arguments=["gap", "h", "fric", "bias1", "mu"]\n',
}


def wrapped(folder, slot, **options):
    """The law's class."""
    folder.mkdir(parents=True, exist_ok=True)
    name = f"old_{slot}_{abs(hash(str(folder))) % 10**8}"
    (folder / "old.f").write_text(SOLVE + PREPARE)
    (folder / "law.toml").write_text(INTERFACES[slot].format(n=name))
    adapter, build = wrap_law(folder / "law.toml", **options)
    assert adapter == folder / f"{name}_adapter.c"
    subprocess.run(build.replace("gcc ", "gcc -Wall -Wextra -Werror "), shell=True, cwd=folder, check=True)
    return cn.plug(folder / f"lib{name}.so", law=name)


@pytest.mark.parametrize("slot", ["solve", "prepare"])
@pytest.mark.parametrize("isolate", [False, True])
def test_an_old_routine_moves_bodies_as_coulomb_does(tmp_path, slot, isolate):
    law = wrapped(tmp_path / f"{slot}{isolate}", slot, isolate=isolate)
    mine, twin = heap(law(fric=0.3)), heap(cn.Coulomb(mu=0.3))
    assert np.allclose(mine.bodies.position, twin.bodies.position, rtol=1e-6)
    assert not np.allclose(mine.bodies.position, heap(cn.Coulomb(mu=0.05)).bodies.position, rtol=1e-6)


def test_a_stop_is_an_error_message_and_the_simulation_lives(tmp_path):
    law = wrapped(tmp_path / "a", "solve", isolate=True)
    with pytest.raises(ValueError, match="OLDLAW ended its process .*OLDLAW GIVES UP.*FRICTION OUT OF TABLE"):
        heap(law(fric=0.95))
    with pytest.raises(ValueError, match=r"OLDGAP ended its process \(exit status 7\)"):
        heap(wrapped(tmp_path / "b", "prepare", isolate=True)(fric=0.95))
    again = heap(law(fric=0.3))  # a new process
    assert np.allclose(again.bodies.position, heap(cn.Coulomb(mu=0.3)).bodies.position, rtol=1e-6)


def test_it_is_serialised_unless_it_says_that_threads_may(tmp_path):
    text = [wrap_law(_interface(tmp_path, extra), tmp_path)[0].read_text() for extra in ("", "thread_safe = true\n")]
    assert "d->thread_unsafe = 1" in text[0] and "d->thread_unsafe = 0" in text[1]


def _interface(folder, extra):
    path = Path(folder) / "i.toml"
    path.write_text(INTERFACES["solve"].format(n="some_law") + extra)
    return path


@pytest.mark.parametrize(
    "old, new, message",
    [
        ('"u1"', '"velocity"', "argument 'velocity' of slot solve is no number and none of"),
        ('slot="solve"', 'slot="resolve"', "give 'solve' or 'prepare'"),
        ('routine="OLDLAW"', 'routin="OLDLAW"', "there is no key 'routin'"),
        ('"r1", "r2", "status:int"', '"1.0"', "give nothing back"),
        ('"status:int"', '"status:long"', "not int, float, double or value"),
        ('name="some_law"\n', "", "key 'name' is missing"),
        ("components=[2", "components=[2 2", "i.toml: "),
    ],
)
def test_wrong_interfaces_are_refused(tmp_path, old, new, message):
    path = _interface(tmp_path, "")
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(ValueError, match=message):
        wrap_law(path)
