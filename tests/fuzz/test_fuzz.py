"""200 damaged files of each kind end in cairn.FileError or are read: no crash, no error of another kind, nothing endless and no
result that is no number. `script/bench fuzz` takes 20,000 of each."""

import signal

import pytest

from .kinds import KINDS, tried

MANY, MOST_SECONDS = 200, 20


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_damaged_files(kind, tmp_path):
    def too_long(*_):
        raise AssertionError(f"{kind.name}, {last}: took more than {MOST_SECONDS} s")

    last, found, before = None, [], signal.signal(signal.SIGALRM, too_long)
    try:

        def begins(*now):
            nonlocal last
            last = now
            signal.alarm(MOST_SECONDS)

        for seed, what, outcome, detail in tried(kind, tmp_path, range(int(MANY * kind.share)), begins):
            found.append(outcome)
            assert outcome in ("refused", "read"), f"{kind.name}, seed {seed}, {what}: {outcome}, {detail}"
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    assert found.count("refused") > MANY * kind.share // 20
