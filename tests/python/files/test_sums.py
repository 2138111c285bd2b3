"""Checksums of runs: `cairn info --check` tells an array that is not as it was written."""

import cairn as cn
import numpy as np
import pytest
from cairn import cli
from cairn.files import sums
from cairn.post import RunWriter
from made_up import write


def test_a_run_is_as_it_was_written_and_a_flipped_bit_is_told(tmp_path, capsys):
    path = tmp_path / "a.vtkhdf"
    write(path, 6).close()
    assert sums.check(path) == {"right": "69 arrays"}
    RunWriter.go_on(path, 2).close()
    assert sums.check(path) == {"right": "69 arrays"}
    assert cli.main(["info", "--check", str(path)]) == 0 and "69 arrays" in capsys.readouterr().out
    with cn.load(path) as run:
        number = run[1].bodies["velocity"][4, 0]
    data = bytearray(path.read_bytes())
    data[data.index(np.float64(number).tobytes())] ^= 1
    path.write_bytes(data)
    with cn.load(path) as run:
        assert run[1].bodies["velocity"][4, 0] != number  # a number as good as any other
    with pytest.raises(cn.FileError, match="bodies/PointData/velocity is damaged: its checksum does not match"):
        sums.check(path)
    assert cli.main(["info", "--check", str(path)]) == 1


def test_a_block_of_noughts_in_a_header_is_told_and_nothing_is_endless(tmp_path):
    sim = cn.Simulation(_scene(), 1e-3, overlap="ignore")
    path = tmp_path / "a.checkpoint.h5"
    sim.checkpoint(path)
    whole = path.read_bytes()
    starts = [k for k in range(len(whole)) if whole[k : k + 4] == b"OHDR"]
    for at in starts[::5]:
        path.write_bytes(whole[: at + 24] + bytes(64) + whole[at + 88 :])
        with pytest.raises(cn.FileError, match="truncated or damaged.*checksum|checksum"):
            sim.restore(path)


def _scene():
    from small_scenes import heap

    return heap(2)
