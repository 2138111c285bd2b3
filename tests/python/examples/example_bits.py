"""The bits in which the examples end, on the machine, by the compiler and the libraries that they were listed for."""

import fcntl
import hashlib
import json
import os
import platform
from pathlib import Path

import cairn as cn
import numpy as np
from cairn import _core

LIST = Path(__file__).with_name("example_bits.json")
WHY = "CAIRN_BITS_WHY"  # set: the list is made anew, and says this


def digest(path):
    """Digest of bodies and nodes of meshes in the last output of a run, as stored."""
    out = hashlib.blake2b(digest_size=12)
    with cn.load(path) as run:
        end = run[-1]
        of_bodies = [(name, end.bodies) for name in ("position", "velocity", "rotation")]
        for name, of in of_bodies + [(name, end.nodes) for name in ("position", "velocity") if len(end.nodes)]:
            values = np.ascontiguousarray(of[name])
            out.update(f"{name} {values.dtype.str} {values.shape} ".encode() + values.tobytes())
    return out.hexdigest()


def made_by():
    """Dependencies of bits besides the code: compiler and flags, the processor seen by -march=native and libraries, mathematical
    libraries."""
    build, known = _core.build_info(), {}
    try:
        with open("/proc/cpuinfo", encoding="ascii") as file:
            for line in file:
                name, _, value = line.partition(":")
                known.setdefault(name.strip(), value.strip())
    except OSError:
        pass
    wanted = ("sse4_2", "avx", "avx2", "fma", "avx512f", "avx512dq", "avx512bw", "avx512vl")
    there = known.get("flags", "").split()
    model = " ".join(known.get(name, "?") for name in ("vendor_id", "cpu family", "model"))
    return {
        "compiler": build["compiler"],
        "flags": build["flags"],
        "processor": f"{platform.machine()} {model} {' '.join(name for name in wanted if name in there)}".strip(),
        "libraries": " ".join([*platform.libc_ver(), "numpy", np.__version__]),
        "blas": os.environ.get("OPENBLAS_CORETYPE", "as the processor asks"),
    }


def listed():
    """why, made_by and bits of the list; empty before the first."""
    if not LIST.exists() or not LIST.stat().st_size:
        return {"why": "", "made_by": {}, "bits": {}}
    return json.loads(LIST.read_text(encoding="utf-8"))


def comparable():
    """Whether the list was made on a machine, by a compiler and with libraries like these."""
    return listed()["made_by"] == made_by()


def renew(found):
    """Puts digests of examples (name -> digest) into the list where WHY is given; several processes may at once."""
    why = os.environ.get(WHY, "").strip()
    if not why or not found:
        return
    with open(LIST, "a+", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        bits = {**listed()["bits"], **found}
        file.truncate(0)
        file.write(json.dumps({"why": why, "made_by": made_by(), "bits": dict(sorted(bits.items()))}, indent=1) + "\n")


def differing(found):
    """Names of examples whose digests (name -> digest) are not those of the list; none where the list is of another
    machine."""
    if not comparable():
        return []
    known = listed()["bits"]
    return sorted(name for name, value in found.items() if known.get(name) != value)
