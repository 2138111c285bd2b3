"""Meshed bodies of DATBOX folders whose models name neoh_, J2iso, J2mix, kvisc, or elas_ at large strains: read, run, refused."""

import cairn as cn
import numpy as np
import pytest
from cairn import legacy
from small_datbox import BAR, BULK, LAW, SEE, body, held, row, write
from test_verify_meshes import block

ELASTIC = ("elas: standard", "ani_: isotropic", "EYng= 1.0000000e+05  EPss= 3.0000000e-01")
VISCOUS = (*ELASTIC, "visc: KelvinVoigt", "ani_: isotropic", "EYng= 2.0000000e+02  EPss= 2.5000000e-01")
PLASTIC = (*ELASTIC, "crit: Von-Mises", "isoh: linear", "SIG0= 2.0000000e+03  K___= 5.0000000e+03", "cinh: none", "visc: none")
SWIFT = (*PLASTIC[:4], "isoh: Swift", "C0__= 4.0000000e+03  EPS0= 2.5000000e-01  n___= 5.0000000e-01", *PLASTIC[6:])
MIXED = (*PLASTIC[:6], "cinh: linear", "K___= 7.0000000e+03", PLASTIC[7])
SWELLING = (*ELASTIC, "cplt:", "Dila= 1.0000000e-05", "Tref= 2.0000000e+01")
ALL = [
    ("small", "elas_", "ELAS", ELASTIC, None, (1e5, 0.3)),
    ("large", "elas_", "ELAS", ELASTIC, "SaintVenantKirchhoff", (1e5, 0.3)),
    ("large", "neoh_", "ELAS", ELASTIC, "NeoHookean", (1e5, 0.3)),
    ("small", "kvisc", "VISCO_ELAS", VISCOUS, "KelvinVoigt", (1e5, 0.3, 2e2, 0.25)),
    ("small", "elas_", "ELAS_PLAS", PLASTIC, None, (1e5, 0.3)),
    ("large", "elas_", "ELAS_PLAS", PLASTIC, "SaintVenantKirchhoff", (1e5, 0.3)),
    ("small", "J2iso", "ELAS_PLAS", PLASTIC, "J2Plasticity", (1e5, 0.3, 2e3, 5e3)),
    ("small", "J2mix", "ELAS_PLAS", MIXED, "J2Plasticity", (1e5, 0.3, 2e3, 5e3, 7e3)),
    ("small", "J2mix", "ELAS_PLAS", PLASTIC, "J2Plasticity", (1e5, 0.3, 2e3, 5e3, 0.0)),
    ("large", "J2iso", "ELAS_PLAS", SWIFT, "FiniteJ2", (1e5, 0.3, 2e3, 0.0, 0.0, 0.25, 0.5)),
    ("large", "J2iso", "ELAS_PLAS", PLASTIC, "FiniteJ2", (1e5, 0.3, 2e3, 5e3)),
    ("small", "elasd", "ELAS_DILA", SWELLING, None, (1e5, 0.3)),
    ("small", "elasd", "THERMO_ELAS", (*SWELLING, "ther:", "SPHV= 1.0000000e+00", "COCO= 3.0000000e+02"), None, (1e5, 0.3)),
]


def folder_of(folder, kinematics, law, name, rows, *more):
    """A block of one cell that falls on a held bar."""
    gummy = f"$behav  lawty\n GUMMY  {name:30s}  Umas= 0.1000000D+04\n" + "".join(" " * 40 + row + "\n" for row in rows)
    bodies = body("RBDY2", BAR, at=(0.5, -0.05, 0), number=1) + block(1, [0, 0.05])
    see = SEE.format("RBDY2", "xxxxx", "JONCx", "DOWNx").replace(" RBDY2  xxxxx  BLEUx", " MAILx  CLxxx  BLUEx")
    write(folder / "DATBOX", bodies, see, LAW.replace("IQS_CLB    ", "GAP_SGR_CLB"), held("RBDY2", 1), bulk=BULK + gummy)
    model = f"$model  mdlty  finel  eleop  value\n M2D_L\n        MECAx  Q4xxx  kine_  {kinematics}\n"
    model += "".join(f"                      {o}\n" for o in (*([f"mater  {law}"] if law else []), "mstrg  lump_", *more))
    (folder / "DATBOX" / "MODELS.DAT").write_text(model)
    return folder


IDS = [f"{k}-{m}-{n}-{len(v)}" for k, m, n, _, _, v in ALL]


@pytest.mark.parametrize("kinematics, law, name, rows, kind, values", ALL, ids=IDS)
def test_a_folder_of_each_material_is_read_and_run(kinematics, law, name, rows, kind, values, tmp_path):
    scene = legacy.read_datbox(folder_of(tmp_path, kinematics, law, name, rows))
    assert not scene.legacy.unmapped
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=0.5, margin=scene.legacy.alert, solver=cn.NLGS(tol=1e-10)), overlap="ignore")
    made = sim.meshes[0].body
    if kind is None:
        assert type(made) is cn.ElasticBody
    else:
        assert made.materials["quad"] == getattr(cn, kind)(**dict(zip(made.materials["quad"].parameter_names, values)))
        assert made.materials["quad"].values[: len(values)] == values
    struck = 0.0
    for _ in range(160):
        assert sim.step()["status"] == "converged"
        struck = max(struck, abs(sim.contacts.impulse).max(initial=0.0))
    terms = sim.info["energy"]
    assert struck > 0 and np.abs(sim.meshes[0].displacement).max() > 1e-3
    assert abs(terms["closure"]) < 1e-7 * terms["in_play"]
    assert (terms["dissipated_material"] > 1e-3) == (law in ("kvisc", "J2iso", "J2mix"))


@pytest.mark.parametrize("law", ["", "elas_", "J2iso"])
def test_a_metal_without_a_library_is_plastic_whatever_its_model_says(law, tmp_path):
    scene = legacy.read_datbox(folder_of(tmp_path, "large", law, "ELAS_PLAS", SWIFT, "form_  UpdtL", "isext  no___"))
    (made,) = (m.body.materials["quad"] for m in cn.Simulation(scene, 1e-3).meshes)
    assert made == cn.FiniteJ2(young=1e5, poisson=0.3, yield_stress=2e3, swift_strain=0.25, swift_power=0.5)
    none = (*SWIFT[:5], SWIFT[5].replace("EPS0= 2.5", "EPS0= 0.0"), *SWIFT[6:])
    with pytest.raises(legacy.LegacyError, match="EPS0=0: it would yield under no stress"):
        legacy.read_datbox(folder_of(tmp_path, "large", law, "ELAS_PLAS", none, "isext  no___"))


@pytest.mark.parametrize("kinematics, law, name, rows, told", [
    ("small", "neoh_", "ELAS", ELASTIC, r"M2D_L \(small, neoh_, iso__\) of material GUMMY \(ELAS\): give kine_ large"),
    ("large", "hyper", "ELAS", ELASTIC, r"M2D_L \(large, hyper, iso__\) of material GUMMY \(ELAS\): give neoh_"),
    ("small", "elas_", "USER_MAT", ELASTIC, r"GUMMY \(USER_MAT\): a library of its own: as a UMAT it is cn.plug"),
    ("large", "J2mix", "ELAS_PLAS", MIXED, r"MAILx 1: model M2D_L \(large, J2mix, iso__\)"),
    ("small", "J2iso", "ELAS_PLAS", MIXED, "material GUMMY has cinh: linear, not none"),
    ("small", "J2mix", "ELAS_PLAS", MIXED[:7] + MIXED[8:], "material GUMMY lacks its K___="),
    ("small", "J2mix", "ELAS_PLAS", MIXED[:7] + ("K___=-1.0000000e+00", MIXED[8]), "K___=-1 behind cinh: give 0 or more"),
    ("small", "J2iso", "ELAS", ELASTIC, r"model M2D_L \(small, J2iso, iso__\) of material GUMMY \(ELAS\)"),
    ("small", "J2iso", "ELAS_PLAS", PLASTIC[:3] + ("crit: Hill",) + PLASTIC[4:], "material GUMMY has crit: Hill, not Von-Mises"),
    ("small", "J2iso", "ELAS_PLAS", PLASTIC[:4] + ("isoh: Hollomon",) + PLASTIC[5:], "isoh: Hollomon, not linear or Swift"),
    ("small", "J__MC", "JOINT_MC", ELASTIC, r"\(JOINT_MC\): joint elements: .*Interface\(normal_stiffness=knc, .*tan\(phi\)"),
    ("small", "JELAS", "JOINT_ELAS", ELASTIC, r"\(JOINT_ELAS\): joint elements: .*cn.CompositeInterface\(normal_stiffness=knc"),
    ("small", "JFCZM", "JOINT_FCZM", ELASTIC, r"\(JOINT_FCZM\): joint elements: .*works of fracture"),
    ("small", "kvisc", "VISCO_ELAS", VISCOUS[:5], "material GUMMY lacks its EYng="),
])  # fmt: skip
def test_what_does_not_map_is_told(kinematics, law, name, rows, told, tmp_path):
    with pytest.raises(legacy.LegacyError, match=told):
        legacy.read_datbox(folder_of(tmp_path, kinematics, law, name, rows))


@pytest.mark.parametrize("element, told", [
    ("J2xx2", "joints of no thickness: contactors on both sides"), ("Q8Rxx", "reduced or mixed"),
    ("DKTxx", "a shell: take solid"), ("SPRG2", "a spring between nodes"), ("BARxx", "cn.bars"),
    ("S2xth", "a wire of a thermal network"), ("PRI6x", "a prism"), ("T3Lxx", "give T3xxx"), ("SHB8x", "a shell: take solid"),
    ("S2xxx", "make bars by cn.bars"),
])  # fmt: skip
def test_elements_that_are_not_there_are_told_with_what_to_give(element, told, tmp_path):
    folder = folder_of(tmp_path, "small", "elas_", "ELAS", ELASTIC) / "DATBOX"
    for name in ("BODIES.DAT", "MODELS.DAT"):
        text = (folder / name).read_text()
        assert "Q4xxx" in text
        (folder / name).write_text(text.replace("Q4xxx", element))
    with pytest.raises(legacy.LegacyError, match=f"element {element}: .*{told}" if "take" in told else told):
        legacy.read_datbox(folder)


def test_a_line_is_told_by_its_model(tmp_path):
    """BODIES.DAT calls bars, springs and lines of heat S2xxx; their model tells which it is."""
    folder = folder_of(tmp_path, "small", "elas_", "ELAS", ELASTIC) / "DATBOX"
    for name, element in (("BODIES.DAT", "S2xxx"), ("MODELS.DAT", "S2xth")):
        text = (folder / name).read_text()
        (folder / name).write_text(text.replace("Q4xxx", element))
    with pytest.raises(legacy.LegacyError, match="element S2xxx: heat along a line: give a wire of a thermal network"):
        legacy.read_datbox(folder)


@pytest.mark.parametrize("kind, told", [
    ("POLYD", "give CSpxx and ASpxx"), ("PT2DL", "join nodes by cn.Spring"), ("DISKL", "give CLxxx and ALpxx"),
])  # fmt: skip
def test_contactors_of_meshes_that_are_not_there_are_told_with_what_to_give(kind, told, tmp_path):
    folder = folder_of(tmp_path, "small", "elas_", "ELAS", ELASTIC) / "DATBOX"
    text = (folder / "BODIES.DAT").read_text()
    assert " CLxxx " in text
    (folder / "BODIES.DAT").write_text(text.replace(" CLxxx ", f" {kind} "))
    with pytest.raises(legacy.LegacyError, match=f"contactor {kind}: .*{told}"):
        legacy.read_datbox(folder)


def test_a_material_that_swells_is_elastic_at_its_reference_temperature(tmp_path):
    """Temperatures come from a script: without them the body is that of elas_, and a note tells so."""
    runs = []
    for law, name, rows in (("elas_", "ELAS", ELASTIC), ("elasd", "ELAS_DILA", SWELLING)):
        (tmp_path / law).mkdir()
        scene = legacy.read_datbox(folder_of(tmp_path / law, "small", law, name, rows))
        told = [note for note in scene.legacy.notes if "elasd" in note]
        assert len(told) == (law == "elasd")
        assert not told or "reference temperature of 20" in told[0] and "expansion=1e-05" in told[0]
        sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=0.5, margin=scene.legacy.alert), overlap="ignore")
        sim.run(steps=100, progress=False)
        runs.append(sim.nodes.position.copy())
    assert np.array_equal(*runs)


def mesh_text(cells, points):
    """A mesh in LMGC90's format: nodes of an element eight on a line."""
    text = "$bdyty\n MAILx      1\n$blmty\n"
    for k, (element, nodes, model, name) in enumerate(cells, 1):
        lines = ["".join(f"{n + 1:7d}" for n in nodes[i : i + 8]) for i in range(0, len(nodes), 8)]
        text += f" {element}{k:7d}  nodes" + ("\n" + " " * 20).join(lines) + "\n"
        text += f"               model  {model}  behav  {name}\n"
    text += "$nodty\n"
    for k, x in enumerate(points, 1):
        text += f" NO{len(x)}xx{k:7d}" + " " * 16 + row(*x).lstrip()
    return text


def meshed(folder, cells, points, models, gummies, below):
    """A MAILx of [(element, nodes, model, material)] above a held bar, candidates on a side below (two nodes)."""
    text = mesh_text(cells, points)
    text += "$tacty\n"
    for k, share in enumerate((0.25, 0.75)):
        text += f"{' +'[k]}CLxxx      1  color  BLUEx  noda={below[0] + 1:5d}  nodb={below[1] + 1:5d}  apab={share:14.7E}\n"
    bodies = body("RBDY2", BAR, at=(0.5, -0.05, 0), number=1) + text + "$$$$$$\n"
    see = SEE.format("RBDY2", "xxxxx", "JONCx", "DOWNx").replace(" RBDY2  xxxxx  BLEUx", " MAILx  CLxxx  BLUEx")
    write(folder / "DATBOX", bodies, see, LAW.replace("IQS_CLB    ", "GAP_SGR_CLB"), held("RBDY2", 1), bulk=BULK + gummies)
    (folder / "DATBOX" / "MODELS.DAT").write_text("$model  mdlty  finel  eleop  value\n" + models)
    return folder


def gummy(name, density, rows, law="ELAS"):
    head = f"$behav  lawty\n {name}  {law:30s}  Umas= {density:13.7E}\n"
    return head + "".join(" " * 40 + line + "\n" for line in rows)


def model(name, element, law="elas_", kinematics="small", mass="lump_"):
    text = f" {name}\n        MECAx  {element}  kine_  {kinematics}\n"
    return text + "".join(f"                      {o}\n" for o in (f"mater  {law}", f"mstrg  {mass}"))


CORNERS = [(0.0, 0.05), (1.0, 0.05), (1.0, 1.05), (0.0, 1.05)]
MIDDLES = [(0.5, 0.05), (1.0, 0.55), (0.5, 1.05), (0.0, 0.55)]


@pytest.mark.parametrize("element, kind", [("T6xxx", "triangle6"), ("Q8xxx", "quad8"), ("Q9xxx", "quad9")])
def test_cells_of_second_order_are_read_and_run(element, kind, tmp_path):
    points = CORNERS + MIDDLES + [(0.5, 0.55)]
    nodes = {"Q8xxx": [list(range(8))], "Q9xxx": [list(range(9))], "T6xxx": [[0, 1, 2, 4, 5, 8], [0, 2, 3, 8, 6, 7]]}[element]
    cells = [(element, of, "M2D_L", "GUMMY") for of in nodes]
    points = points[:8] if element == "Q8xxx" else points
    folder = meshed(tmp_path, cells, points, model("M2D_L", element), gummy("GUMMY", 1e3, ELASTIC), (0, 1))
    scene = legacy.read_datbox(folder)
    assert not scene.legacy.unmapped
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=0.5, margin=scene.legacy.alert, solver=cn.NLGS(tol=1e-10)), overlap="ignore")
    mesh = sim.meshes[0]
    assert list(mesh.body.cells) == [kind] and mesh.body.nodal_mass().sum() == pytest.approx(1e3, rel=1e-12)
    struck = 0.0
    for _ in range(130):
        assert sim.step()["status"] == "converged"
        struck = max(struck, abs(sim.contacts.impulse).max(initial=0.0))
    assert struck > 0 and abs(sim.info["energy"]["closure"]) < 1e-8 * sim.info["energy"]["in_play"]


@pytest.mark.parametrize("second, kinematics", [("elas_", "small"), ("J2iso", "small"), ("neoh_", "large")])
def test_a_body_of_several_materials_has_those_of_its_cells(second, kinematics, tmp_path):
    points = [*CORNERS, (2.0, 0.05), (2.0, 1.05)]
    cells = [("Q4xxx", [0, 1, 2, 3], "FIRST", "GUMMY"), ("Q4xxx", [1, 4, 5, 2], "OTHER", "STEEL")]
    rows = PLASTIC if second == "J2iso" else ELASTIC
    laws = gummy("GUMMY", 1e3, ELASTIC) + gummy("STEEL", 3e3, rows, "ELAS_PLAS" if second == "J2iso" else "ELAS")
    models = model("FIRST", "Q4xxx", kinematics=kinematics) + model("OTHER", "Q4xxx", second, kinematics)
    scene = legacy.read_datbox(meshed(tmp_path, cells, points, models, laws, (0, 1)))
    assert not scene.legacy.unmapped
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=0.5, margin=scene.legacy.alert, solver=cn.NLGS(tol=1e-10)), overlap="ignore")
    made = sim.meshes[0].body
    first = "SaintVenantKirchhoff" if kinematics == "large" else "IsotropicElastic"
    other = {"elas_": "IsotropicElastic", "J2iso": "J2Plasticity", "neoh_": "NeoHookean"}[second]
    assert [type(m).__name__ for m in made.materials["quad"]] == [first, other]
    assert made.nodal_mass() == pytest.approx([250, 1000, 1000, 250, 750, 750], rel=1e-12)
    for _ in range(130):
        assert sim.step()["status"] == "converged"
    assert abs(sim.info["energy"]["closure"]) < 1e-7 * sim.info["energy"]["in_play"]


def test_models_that_differ_in_kinematics_within_a_body_are_told(tmp_path):
    points = [*CORNERS, (2.0, 0.05), (2.0, 1.05)]
    cells = [("Q4xxx", [0, 1, 2, 3], "FIRST", "GUMMY"), ("Q4xxx", [1, 4, 5, 2], "OTHER", "GUMMY")]
    models = model("FIRST", "Q4xxx") + model("OTHER", "Q4xxx", "neoh_", "large")
    with pytest.raises(legacy.LegacyError, match="several physics, kinematics or masses in one body"):
        legacy.read_datbox(meshed(tmp_path, cells, points, models, gummy("GUMMY", 1e3, ELASTIC), (0, 1)))


def curved(kind):
    """Corners, then middles of edges that are bent: nodes (n, 3) [m] in LMGC90's order, the ends of each edge (mod_a_EF.f90)."""
    if kind == "tetra10":
        corners = [(0.0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        edges = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    else:
        corners = [(x, y, z) for z in (0.0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
        ring = [(0, 1), (1, 2), (2, 3), (3, 0)]
        edges = [*ring, *[(a + 4, b + 4) for a, b in ring], *[(a, a + 4) for a in range(4)]]
    x = np.array(corners)
    middles = np.array([(x[a] + x[b]) / 2 for a, b in edges])
    return np.vstack((x, middles + 0.04 * np.sin(7.0 * np.arange(3 * len(edges)) + 1).reshape(-1, 3)))


def volume_by_shape_functions(kind, x):
    """With LMGC90's shape functions and Gauss's rule: an independent way to the mass, which knows the order of the nodes."""
    along, weight = np.polynomial.legendre.leggauss(6)
    if kind == "tetra10":  # the cube drawn together to a corner
        u, v, w = (a.ravel() for a in np.meshgrid(*3 * [(along + 1) / 2], indexing="ij"))
        at = np.column_stack((u, v * (1 - u), w * (1 - u) * (1 - v)))
        weights = np.prod(np.meshgrid(*3 * [weight / 2], indexing="ij"), axis=0).ravel() * (1 - u) ** 2 * (1 - v)
    else:
        at = np.stack(np.meshgrid(*3 * [along], indexing="ij"), -1).reshape(-1, 3)
        weights = np.prod(np.meshgrid(*3 * [weight], indexing="ij"), axis=0).ravel()

    def shape(p):
        a, b, c = p.T
        if kind == "tetra10":
            d = 1 - a - b - c
            corner = [f * (2 * f - 1) for f in (d, a, b, c)]
            return np.array([*corner, 4 * a * d, 4 * a * b, 4 * b * d, 4 * c * d, 4 * a * c, 4 * b * c])
        signs = np.array([(x, y, z) for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
        corner = [(1 + x * a) * (1 + y * b) * (1 + z * c) * (x * a + y * b + z * c - 2) / 8 for x, y, z in signs]
        flat = lambda z: [(1 - a * a) * (1 - b) * (1 + z * c), (1 + a) * (1 - b * b) * (1 + z * c),
                          (1 - a * a) * (1 + b) * (1 + z * c), (1 - a) * (1 - b * b) * (1 + z * c)]  # fmt: skip
        upright = [(1 + x * a) * (1 + y * b) * (1 - c * c) for x, y, _ in signs[:4]]
        return np.array([*corner, *[f / 4 for f in (*flat(-1), *flat(1), *upright)]])

    step = 1e-4  # the functions are of the second degree along each axis but for mixed ones: differences to 1e-8
    slope = np.stack([(shape(at + step * e) - shape(at - step * e)) / (2 * step) for e in np.eye(3)])
    return float(weights @ np.linalg.det(np.einsum("jnq,ni->qij", slope, x)))


@pytest.mark.parametrize("element, kind", [("TE10x", "tetra10"), ("H20xx", "hexahedron20")])
def test_cells_of_second_order_in_space_have_their_nodes_in_order(element, kind, tmp_path):
    x = curved(kind)
    text = mesh_text([(element, list(range(len(x))), "M3D_L", "GUMMY")], [tuple(p) for p in x])
    write(tmp_path / "DATBOX", text + "$$$$$$\n", "", "", "", bulk=BULK + gummy("GUMMY", 1e3, ELASTIC))
    model_text = "$model  mdlty  finel  eleop  value\n" + model("M3D_L", element)
    (tmp_path / "DATBOX" / "MODELS.DAT").write_text(model_text)
    scene = legacy.read_datbox(tmp_path)
    assert not scene.legacy.unmapped
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=0.5))
    body = sim.meshes[0].body
    assert list(body.cells) == [kind] and body.points == pytest.approx(x, abs=1e-7)
    assert body.nodal_mass().sum() == pytest.approx(1e3 * volume_by_shape_functions(kind, x), rel=1e-6)
    assert sim.step()["status"] == "converged"
    broken = (tmp_path / "DATBOX" / "BODIES.DAT").read_text().splitlines()
    at = next(k for k, line in enumerate(broken) if line.startswith(f" {element}")) + 1
    (tmp_path / "DATBOX" / "BODIES.DAT").write_text("\n".join(broken[:at] + broken[at + 1 :]))
    with pytest.raises(legacy.LegacyError, match=f"element {element} has {12 if len(x) == 20 else 8} nodes, not {len(x)}"):
        legacy.read_datbox(tmp_path / "DATBOX")
