"""Remedies for elements and models of meshed bodies that Cairn does not have."""

from __future__ import annotations

ZONES = ("joints of no thickness: contactors on both sides (CSpxx and ASpxx, in 2D CLxxx and ALpxx) with a law such as "
         "MAL_CZM or GAP_MOHR_DS_CLB, or cn.fracture.split")  # fmt: skip
FULL = "reduced or mixed integration: take Q8xxx, H20xx or another full one, which is stiffer by it"
SPRINGS = "a spring between nodes: points on both (PT2Dx, PT3Dx) with ELASTIC_ROD, or cn.Rod"
JOINTS = ("joint elements: cut the body there, by cn.fracture.split or into a mesh for each side, and give the faces "
          "cn.CompositeInterface(normal_stiffness=knc, tangential_stiffness=kt, ")  # fmt: skip
MOHR_COULOMB = JOINTS + ("tension=ftrc, cohesion=C, friction=tan(phi), mu=tan(phi), dilatancy=tan(zmu), normal_work=inf, "
                         "tangential_work=inf, closes=0)")  # fmt: skip
SHELLS = "a shell: take solid cells through its thickness, H8xxx or better H20xx"
ELEMENTS = {
    **dict.fromkeys(("J2xx2", "J3xx2", "J3xx3", "J4xx3"), ZONES),
    **dict.fromkeys(("Q8Rxx", "H20Rx", "Q44xx", "Q84xx", "T33xx", "H88xx", "H208x", "TE44x", "TE104"), FULL),
    **dict.fromkeys(("DKTxx", "SHB6x", "SHB8x", "SHB20", "SHB15"), SHELLS),
    **dict.fromkeys(("SPRG2", "SPRG3", "SPRNG"), SPRINGS),
    "T3Lxx": "give T3xxx",
    "TE4Lx": "give TE4xx",
    "BARxx": "a bar: make it by cn.bars, whose section no DATBOX holds",
    "S2xxx": "a line: make bars by cn.bars, whose section no DATBOX holds",
    "Beam": "a beam: make it by cn.beams",
    "Cable": "a cable: make it by cn.bars, or bodies with ELASTIC_WIRE",
    "S2xth": "heat along a line: give a wire of a thermal network, wires=[(body, body, conductance)]",
    "PRI6x": "a prism: cut it into tetrahedra, TE4xx",
    "PRI15": "a prism: cut it into tetrahedra, TE10x",
}
CONTACTORS = {
    **dict.fromkeys(("PT2DL", "PT2TL"), "a point on an edge: join nodes by cn.Spring or cn.Cable, in heat by a wire"),
    "POLYD": "a polyhedron carried by a mesh: give CSpxx and ASpxx on the faces of the mesh",
    "DISKL": "a round end of an edge: give CLxxx and ALpxx, or a disk of its own (DISKx) held by cn.Spring",
}
PHYSICS = {
    "POROx": "no flow in pores: read_datbox(drained=True) reads their solid, without pressure",
    "MULTI": "no mixtures: give the solid as MECAx and its heat as THERM",
}
MODELS = {
    "hyper": "give neoh_ with kine_ large, or read_datbox(materials={name: cn.NeoHookean(...)})",
    "hyp_d": "give neoh_ with kine_ large, or read_datbox(materials={name: cn.NeoHookean(...)})",
    "neoh_": "give kine_ large",
    "J2mix": "give J2iso, or kine_ small",
    "J2iso": "give a material ELAS_PLAS",
    "USER_MAT": "a library of its own: as a UMAT it is cn.plug(library, material=...), see the page on solids; "
                "read_datbox(materials={name: ...}) takes it, or cn.NeoHookean(...) and others, in its place",
    "JOINT_ELAS": JOINTS + "tension=inf, cohesion=inf, normal_work=inf, tangential_work=inf, closes=0)",
    "JOINT_MC": MOHR_COULOMB,
    "JOINT_FCZM": MOHR_COULOMB + ", with the works of fracture in place of inf",
    "orth_": "read_datbox(materials={name: cn.OrthotropicElastic(...)})",
}


def after(text, *words_of):
    """A text with the remedy that the first known of (table, word) has behind it."""
    remedy = next((table[word] for table, word in words_of if word in table), "")
    return f"{text}: {remedy}" if remedy else text
