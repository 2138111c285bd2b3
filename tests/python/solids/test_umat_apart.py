"""UMATs in a process of their own: the same bits as in this one, and errors where they stop, crash, hang or write too much."""

import shutil
import subprocess
import time
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn import SolidBody
from second_order import box

COMPILER = shutil.which("gfortran")
pytestmark = pytest.mark.skipif(COMPILER is None, reason="needs gfortran")
ENDS = {  # statement of the routine where the strain along the first axis is above a half
    "stops": "write(*, *) 'the strain is too large'; stop 3",
    "crashes": "call crash(ddsdde)",
    "hangs": "do while (stran(1) + dstran(1) > 0.5d0); end do",
}
CRASH = """
subroutine crash(a)
  use, intrinsic :: iso_c_binding
  real(8) :: a(*)
  real(8), pointer :: nowhere
  call c_f_pointer(transfer(8_c_intptr_t, c_null_ptr), nowhere)
  nowhere = a(1)
end subroutine
"""


def library(folder, name, instead=None):
    text = Path(__file__).with_name("umat.f90").read_text()
    if instead:
        where = "if (stran(1) + dstran(1) > 0.5d0)"
        text = text.replace(f"{where} call xit", f"{where} then; {instead}; end if")
    (folder / f"{name}.f90").write_text(text + CRASH)
    command = [COMPILER, "-shared", "-fPIC", "-O1", "-ffree-line-length-200", "-o", f"lib{name}.so", f"{name}.f90"]
    subprocess.run(command, check=True, cwd=folder)
    return folder / f"lib{name}.so"


def pulled(material, far=1.0, **options):
    points, cells = box("quad", (2, 1), (2.0, 1.0))
    groups = {"left": points[:, 0] < 0.5, "right": points[:, 0] > 1.5}
    body = SolidBody(points, cells, material, density=1.0, groups=groups)
    scene, skin = cn.Scene(2), cn.Material("skin", density=1.0)
    scene.add(cn.deformable(body, skin, fixed={"left": "xy"}, displace={"right": {"x": lambda t: far * t}}, contact=[0]))
    scene.interact(skin, skin, None)
    return cn.Simulation(scene, 0.1, cn.NSCD(theta=1.0, **options))


def test_it_has_the_bits_of_one_in_this_process(tmp_path, capfd):
    path = library(tmp_path, "calm")
    kinds = [cn.plug(path, material=f"calm_{apart}", state=1, isolate=apart) for apart in (False, True)]
    found = []
    for kind in kinds:
        sim = pulled(kind(3.0, 0.3, 0.05), far=0.3)
        for _ in range(8):
            sim.step()
        found.append((sim.meshes[0].displacement, sim.meshes[0].stress["quad"], sim.meshes[0].material_state["quad"]["statev1"]))
    for one, other in zip(*found):
        assert np.array_equal(one, other)
    assert found[0][2].max() > 0


@pytest.mark.parametrize(
    "how, told", [("stops", r"\(exit status 3\); it said: .*the strain is too large"), ("crashes", r"\(signal 11\)")]
)
def test_what_ends_its_process_is_an_error_of_the_step(how, told, tmp_path):
    kind = cn.plug(library(tmp_path, how, ENDS[how]), material=how, state=1, isolate=True)
    for cut_back in (0, 2):
        sim = pulled(kind(3.0, 0.3, 0.0), cut_back=cut_back)
        where = r"quad cell \d with nodes .*"
        with pytest.raises(ValueError, match=rf"{where}{how} ended its process {told}.* in step \d+: mend the routine"):
            for _ in range(30):
                sim.step()
        steps, place = sim.steps, sim.meshes[0].displacement
        assert 5 <= steps < 30
        with pytest.raises(ValueError, match="ended its process"):  # a new one is begun, and ends as the first did
            sim.step()
        assert sim.steps == steps and np.array_equal(sim.meshes[0].displacement, place)
    fresh = pulled(kind(3.0, 0.3, 0.0))
    assert fresh.step()["status"] == "converged"


def test_an_error_within_an_open_ends_the_process_at_once(tmp_path):
    """The run-time library holds the lock of the unit, for which a flush would wait until the time limit of 60 s."""
    path = library(tmp_path, "opens", "open (31, file='no such file', status='old')")
    kind = cn.plug(path, material="opens", state=1, isolate=True)
    sim, begin = pulled(kind(3.0, 0.3, 0.0)), time.monotonic()
    with pytest.raises(ValueError, match=r"opens ended its process \(exit status 2\); it said: .*Cannot open file"):
        for _ in range(30):
            sim.step()
    assert time.monotonic() - begin < 30


def test_what_hangs_is_stopped(tmp_path):
    kind = cn.plug(library(tmp_path, "hangs", ENDS["hangs"]), material="hangs", state=1, isolate=True, time_limit=0.5)
    sim = pulled(kind(3.0, 0.3, 0.0))
    begin = time.monotonic()
    with pytest.raises(ValueError, match=r"hangs did not end within 0.5 s \(time_limit\) and was stopped"):
        for _ in range(30):
            sim.step()
    assert time.monotonic() - begin < 20


def test_a_body_that_is_asked_alone_is_told_so_as_well(tmp_path):
    kind = cn.plug(library(tmp_path, "alone", ENDS["stops"]), material="alone", state=1, isolate=True)
    points, cells = box("quad", (3, 1), (3.0, 1.0))
    body = SolidBody(points, cells, kind(3.0, 0.3, 0.0))
    u = np.zeros_like(points)
    u[points[:, 0] > 2.5, 0] = 0.7
    with pytest.raises(ValueError, match=r"quad cell 2 .*alone ended its process \(exit status 3\).*: mend the routine"):
        body.tangent(u)
    assert np.isfinite(body.tangent(0.1 * u)[0]).all()


def test_what_it_prints_comes_out_and_none_is_left(tmp_path, capfd):
    kind = cn.plug(library(tmp_path, "talks", "write(*, *) 'I am asked'; call xit"), material="talks", state=1, isolate=True)
    points, cells = box("quad", (1, 1), (1.0, 1.0))
    body = SolidBody(points, cells, kind(3.0, 0.3, 0.0))
    with pytest.raises(ValueError, match="talks calls XIT"):
        body.tangent(0.7 * points)
    assert "I am asked" in capfd.readouterr().out


def test_a_new_dt_is_no_remedy_for_what_writes_too_much(tmp_path):
    text = "stress(6) = 1"
    for apart in (False, True):
        kind = cn.plug(library(tmp_path, f"wide_{apart}", text), material=f"wide_{apart}", state=1, isolate=apart)
        sim = pulled(kind(3.0, 0.3, 0.0), cut_back=2)
        with pytest.raises(ValueError, match=r"writes beyond the NTENS = 4 .* give a routine that goes by NDI") as told:
            for _ in range(30):
                sim.step()
        assert "dt" not in str(told.value)


def test_options_that_do_not_fit_are_refused(tmp_path):
    path = library(tmp_path, "any")
    with pytest.raises(ValueError, match="time_limit is 5, of a routine in a process of its own"):
        cn.plug(path, material="any", time_limit=5)
    with pytest.raises(ValueError, match="time_limit"):
        cn.plug(path, material="any", isolate=True, time_limit=0)
    with pytest.raises(ValueError, match="isolate is for material=, not for law="):
        cn.plug(path, law="any", isolate=True)
