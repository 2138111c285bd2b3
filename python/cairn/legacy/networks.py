"""Heat and currents of a DATBOX: MP_DEM.DAT between rigid bodies, meshes of physics THERM."""

from __future__ import annotations

import numpy as np

from .drives import function_of
from .text import REAL, LegacyError, Reader, fortran

# {label in a material: field of cairn.Material}.
LABELS = {"TCnd": "conductivity", "HPse": "capacity", "Hspe": "capacity", "Eth_": "young", "Nuth": "poisson", "Eeq": "young",
          "Nueq": "poisson", "SPHV": "capacity", "COCO": "conductivity", "Dila": "expansion", "EYng": "young",
          "Epss": "poisson"}  # fmt: skip
LOCAL = {"allno": "LegacyAllno", "hertz": "LegacyHertz", "HolmH": "LegacyHolmH", "HolmP": "LegacyHolmP", "Tkaya": "LegacyTkaya"}
NODES = ("DISKx", "JONCx", "POLYG", "xKSID")  # contactors that are thermal nodes, in this order


def values_of(bulk):
    """{label: number} of the further lines of a material."""
    found = {}
    for _, text in bulk.parts:
        for first in (41, 62, 83):
            label, number = text[first - 1 : first + 4], REAL.fullmatch(text[first + 4 : first + 18].replace(" ", ""))
            if label.endswith("=") and number:
                found[label[:-1].strip()] = fortran(number)
    return found


def properties(bulk):
    """Arguments of cairn.Material for a thermal or electrical material; {} for others."""
    if bulk.law not in ("THERMO_RIGID", "ELECTRO_RIGID", "THERMO_ELAS"):
        return {}
    values = values_of(bulk)
    out = {LABELS[label]: value for label, value in values.items() if label in LABELS}
    if "Ecnd" in values:
        out["resistivity"] = 1 / values["Ecnd"]
    return out


def add(scene, box, origin):
    """Adds the networks of the files to a scene; parts that cannot be mapped go to origin.unmapped."""
    if (box.folder / "MP_DEM.DAT").is_file():
        _add_grains(scene, box, origin)
    heated = getattr(origin, "heated", [])
    if heated:
        _add_meshes(scene, origin, heated)


def _add_meshes(scene, origin, heated):
    origin.notes.append("heat in meshes: theta 1/2, which a DATBOX does not say")
    held, given, initial = [], [], []
    for name, _, drives, temperatures in heated:
        initial += [(f"{name}.node {k}", t) for k, t in enumerate(temperatures)]
        for node, d in drives:
            (held if d.kind == "temp" else given).append((f"{name}.node {node}", function_of(d)))
    lumped = all(body.heat_lumped for _, body, _, _ in heated)
    if not lumped and all(set(body.cells) == {"triangle"} for _, body, _, _ in heated):
        lumped = "one point"
    scene.thermal(initial=initial, temperature=held, power=given, theta=0.5, lumped=lumped, friction="none", joule="none")


def _add_grains(scene, box, origin):
    from ..networks import CONDUCTANCES

    models, bounds, sources = _read(box)
    if "elec_:" in models:
        m = models["elec_:"]
        told = {k: m.get(k, "no") for k in ("oxide", "brkdw", "sldng")}
        kind, *numbers = m.get("curnt", "none").split()
        kind = kind.rstrip("=")
        if kind != "const" or m.get("local") not in LOCAL or any(v != "no" for v in told.values()):
            origin.unmapped.append(
                f"MP_DEM.DAT: current {m.get('curnt', m.get('tensn'))}, local {m.get('local')}, {told}: currents of constant "
                "size without oxide, breakdown and sliding are read; give scene.electrical(...)"
            )
        else:
            current = _number(box, numbers[0])
            pairs = [(np.array([body - 1]), sign * current) for body, sign in bounds]
            scene.electrical(conductance=CONDUCTANCES[LOCAL[m["local"]]](), current=pairs)
    if "therm" in models:
        m = models["therm"]
        if m.get("ldiff") != "Hertz discrete" or m.get("lconv") != "no" or m.get("lkine") != "no" or m.get("bound") != "adia":
            told, read = ", ".join(f"{k} {v}" for k, v in m.items()), "ldiff Hertz discrete, lconv no, lkine no and bound adia"
            origin.unmapped.append(f"MP_DEM.DAT: heat with {told}: {read} are read; give scene.thermal(...)")
            return
        order = [body.number for kind in NODES for body in box.bodies for c in body.contactors if c.type == kind]
        held = []
        for first, last, value in sources:
            if not 1 <= first <= last <= len(order):
                raise LegacyError(f"{box.folder / 'MP_DEM.DAT'}: source of nodes {first} to {last}: there are {len(order)}")
            held.append((np.array(order[first - 1 : last]) - 1, value))
        scene.thermal(conductance=CONDUCTANCES["LegacyDiscrete"](), initial=_number(box, m["T0___"]), temperature=held,
                      friction="none", joule="none", theta=0.5)  # fmt: skip
        origin.notes.append("heat between bodies: implicit, theta 1/2, where LMGC90 steps explicitly")


def _number(box, text):
    found = REAL.fullmatch(text)
    if not found:
        raise LegacyError(f"{box.folder / 'MP_DEM.DAT'}: {text!r} is no number: write one as 1.0d-3")
    return fortran(found)


def _read(box):
    """({model: {keyword: words}}, [(body, sign)] of electrodes, [(first, last node, temperature)]) of MP_DEM.DAT."""
    reader = Reader(box.folder / "MP_DEM.DAT")
    models, bounds, sources, now = {}, [], [], None
    while not reader.ended:
        line = reader.next()
        if line.startswith("$model"):
            now = models.setdefault(line[6:].strip(), {})
        elif line.startswith("$bounds"):
            line, now = reader.next(), None
            bounds.append((reader.whole(line, 10, 16), -1.0 if line[37:38] == "-" else 1.0))
        elif line.startswith("$source"):
            line, now = reader.next(), None
            first = reader.whole(line, 10, 16)
            last = reader.whole(line, 23, 29) if line[22:29].strip().isdigit() else first
            sources.append((first, last, reader.number(line, 37, 50)))
        elif line.startswith("$"):
            now = None
        elif now is not None and line[14:20].strip():
            line = line.partition("!")[0].rstrip()  # without a comment
            word, _, rest = line[14:].replace("=", "= ").partition(":")
            if not rest:  # T0___= 293
                word, _, rest = line[14:].partition("=")
            now[word.strip().rstrip("=").strip()] = " ".join(rest.split())
    return models, bounds, sources
