"""Scalar routines of another time as contact laws: COMMON data, prints and STOP among them."""

import os
import shutil
import signal
import subprocess
import sys
import time
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
# Fast ones are refused in two ways.
IMPACT = """
      SUBROUTINE IMPACT(UN, UT, WN, WT, FRIC, RN, RT)
      DOUBLE PRECISION UN, UT, WN, WT, FRIC, RN, RT
      IF (UN .LT. -5.D0 .AND. FRIC .GT. 0.5D0) STOP 'TOO FAST'
   10 IF (UN .LT. -5.D0) GO TO 10
      RN = MAX(0.D0, -UN/WN)
      RT = 0.D0
      END
"""
INTERFACES = {
    "impact": 'name="{n}"\nroutine="IMPACT"\nslot="solve"\nsources=["old.f"]\nparameters="fric::0:inf"\ncomponents=[2, 0]\n'
    'arguments=["u1", "u2", "w11", "w22", "fric", "r1", "r2"]\n',
    "solve": 'name="{n}"\nroutine="OLDLAW"\nslot="solve"\nsources=["old.f"]\nparameters="fric::0:inf"\ncomponents=[2, 0]\n'
    'arguments=["u1", "u2", "w11", "w22", "fric", "r1", "r2", "status:int"]\n',
    "prepare": 'name="{n}"\nroutine="OLDGAP"\nslot="prepare"\nsources=["old.f"]\nparameters="fric::0:inf"\ncomponents=[2, 3]\n'
    'arguments=["gap", "h", "fric", "bias1", "mu"]\n',
}


def wrapped(folder, slot, **options):
    """The law's class."""
    folder.mkdir(parents=True, exist_ok=True)
    name = f"old_{slot}_{abs(hash(str(folder))) % 10**8}"
    (folder / "old.f").write_text(SOLVE + PREPARE + IMPACT)
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


def row(law, fast):
    """Eleven disks on a floor; one of them falls fast."""
    rock = cn.Material("rock", density=2700.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks(np.column_stack([0.3 * np.arange(11), np.full(11, 0.1)]), 0.1, rock), cn.wall((0, 0), (0, 1), rock))
    scene.interact(rock, rock, law)
    sim = cn.Simulation(scene, dt=1e-3)
    velocity = np.array(sim.bodies.velocity)
    velocity[fast, 1] = -20.0
    sim.bodies.set(velocity=velocity)
    return sim


@pytest.mark.parametrize("fast", [0, 6, 10])
def test_the_contact_at_which_a_routine_ended_or_stayed_is_named(tmp_path, fast):
    law = wrapped(tmp_path / "a", "impact", isolate=True, time_limit=0.5)
    with pytest.raises(cn.Error, match=rf"between bodies {fast} and 11 .*IMPACT ended its process .*TOO FAST"):
        row(law(fric=0.9), fast).step()
    with pytest.raises(cn.Error, match=rf"between bodies {fast} and 11 .*IMPACT did not end within 0.5 s \(time_limit\)"):
        row(law(fric=0.1), fast).step()
    sim = row(law(fric=0.1), fast)
    sim.bodies.set(velocity=np.zeros((12, 3)))
    assert sim.step()["status"] == "converged"  # by a new process


def test_signals_to_the_parent_are_not_the_end_of_the_routine(tmp_path):
    law = wrapped(tmp_path / "a", "solve", isolate=True)(fric=0.3)
    quiet = heap(law)
    before = signal.signal(signal.SIGUSR1, lambda *_: None)
    shower = subprocess.Popen(["sh", "-c", f"while kill -USR1 {os.getpid()}; do :; done"])
    try:
        assert np.array_equal(heap(law).bodies.position, quiet.bodies.position)
        assert shower.poll() is None
    finally:
        shower.kill()
        shower.wait()
        signal.signal(signal.SIGUSR1, before)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_run_with_an_isolated_routine_ends_after_the_step_at_hand(tmp_path, number):
    """The signal goes to the child too, as that of a terminal does."""
    law = wrapped(tmp_path / "a", "solve", isolate=True)
    script = tmp_path / "run.py"
    script.write_text(
        f"import sys\nsys.path.insert(0, {os.path.dirname(__file__)!r})\nimport cairn as cn\nfrom test_plug import heap\n"
        f"law = cn.plug({os.fspath(tmp_path / 'a' / ('lib' + law.name + '.so'))!r}, law={law.name!r}, params=[0.3])\n"
        "sim = heap(law, 5)\nprint('ready', flush=True)\nsim.run(10**6, output='run.vtkhdf', every=1000, progress=False)\n"
    )
    run = subprocess.Popen([sys.executable, script], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                           start_new_session=True)  # fmt: skip
    run.stdout.readline()
    time.sleep(0.3)
    os.killpg(run.pid, number)
    try:
        said = run.communicate(timeout=30)[1]
    except subprocess.TimeoutExpired:
        os.killpg(run.pid, signal.SIGKILL)
        raise
    assert "Error" not in said and (tmp_path / "run.vtkhdf").exists(), said


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
        ('name="some_law"', 'time_limit=0\nname="some_law"', "time_limit is 0: give seconds"),
        ("components=[2", "components=[2 2", "i.toml: "),
    ],
)
def test_wrong_interfaces_are_refused(tmp_path, old, new, message):
    path = _interface(tmp_path, "")
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(ValueError, match=message):
        wrap_law(path)


DECK = """
      SUBROUTINE OLDINI(NAME)
      CHARACTER*(*) NAME
      DOUBLE PRECISION FRIC
      INTEGER NTIMES
      COMMON /DECK/ FRIC, NTIMES
      SAVE /DECK/
      OPEN(17, FILE=NAME, STATUS='OLD')
      READ(17, *) FRIC
      CLOSE(17)
      IF (FRIC .LT. 0.D0) STOP 'NEGATIVE FRICTION IN DECK'
      END
      SUBROUTINE OFDECK(G, H, B, F)
      DOUBLE PRECISION G, H, B, F, FRIC
      INTEGER NTIMES
      COMMON /DECK/ FRIC, NTIMES
      SAVE /DECK/
      B = MAX(G, 0.D0)/H
      F = FRIC
      END
"""


@pytest.mark.parametrize("isolate", [False, True])
def test_a_routine_that_reads_a_deck_before_the_first_contact(tmp_path, monkeypatch, isolate):
    folder, name = tmp_path / 'a "deck"', f"of_deck_{int(isolate)}"
    folder.mkdir()
    (folder / "law.f").write_text(DECK)
    (folder / "steel.dat").write_text("0.3\n")
    text = f'name="{name}"\nroutine="OFDECK"\nslot="prepare"\nsources=["law.f"]\ninit="OLDINI"\n'
    text += 'arguments=["gap", "h", "bias1", "mu"]\n'
    (folder / "law.toml").write_text(text + 'deck="steel.dat"\n')
    _, build = wrap_law(folder / "law.toml", isolate=isolate)
    subprocess.run(build.replace("gcc ", "gcc -Wall -Wextra -Werror "), shell=True, cwd=folder, check=True)
    monkeypatch.chdir(tmp_path)
    law = cn.plug(folder / f"lib{name}.so", law=name)
    assert np.allclose(heap(law()).bodies.position, heap(cn.Coulomb(mu=0.3)).bodies.position, rtol=1e-6)
    if isolate:
        (folder / "steel.dat").write_text("-1.0\n")
        _, build = wrap_law(folder / "law.toml", isolate=True, name="of_bad_deck")
        subprocess.run(build, shell=True, cwd=folder, check=True)
        with pytest.raises(ValueError, match="OFDECK ended its process.*NEGATIVE FRICTION IN DECK"):
            heap(cn.plug(folder / "libof_bad_deck.so", law="of_bad_deck")())
        (folder / "steel.dat").unlink()
        begin = time.monotonic()
        with pytest.raises(ValueError, match="OFDECK ended its process.*Cannot open file"):  # with the lock of its unit
            heap(cn.plug(folder / "libof_bad_deck.so", law="of_bad_deck", replace=True)())
        assert time.monotonic() - begin < 30.0, "not the time limit of 60 s"
    with pytest.raises(ValueError, match="deck is 'brass.dat': there is no file"):
        wrap_law(folder / "law.toml", deck="brass.dat")
    (folder / "law.toml").write_text(text.replace('init="OLDINI"', 'deck="steel.dat"'))
    with pytest.raises(ValueError, match="there is no init"):
        wrap_law(folder / "law.toml")


LATE = """
#include "law_adapter.c"
int main(void) { /* a byte of the call before, whose sender was held up until the other slept again */
  double w[4] = {1, 0, 0, 1}, u[2] = {0, 0}, bias[2] = {0, 0}, fric = 0.3, r[2];
  int32_t status;
  for (int call = 1; call <= 20; ++call) {
    u[0] = -call, r[0] = r[1] = 0;
    solve(1, 2, w, u, bias, &fric, NULL, r, &status);
    if (r[0] != call) return printf("call %d gave the impulse %g\\n", call, r[0]), 1;
    while (!__atomic_load_n(&ring_of(asked)->sleeps, __ATOMIC_SEQ_CST)) usleep(200);
    if (__atomic_exchange_n(&ring_of(asked)->sleeps, 0, __ATOMIC_SEQ_CST)) give(line, "x", 1);
    usleep(2000);
  }
  return 0;
}
"""


def test_an_isolated_routine_answers_only_what_it_is_asked(tmp_path):
    """Woken by a byte that came late it sleeps again, and does not answer what it was asked before."""
    (tmp_path / "old.f").write_text(SOLVE + PREPARE + IMPACT)
    (tmp_path / "law.toml").write_text(INTERFACES["solve"].format(n="law"))
    wrap_law(tmp_path / "law.toml", isolate=True)
    (tmp_path / "late.c").write_text(LATE)
    build = "gcc -O2 -c late.c && gfortran late.o old.f -o late && ./late"
    told = subprocess.run(build, shell=True, cwd=tmp_path, capture_output=True, text=True, timeout=100)
    assert told.returncode == 0, (told.stdout, told.stderr)
