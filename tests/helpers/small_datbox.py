"""Small DATBOX folders, written line by line."""

BULK = """! materials
$gravy
                   grv1= 0.0000000D+00  grv2=-0.9810000D+01  grv3= 0.0000000D+00
$behav  lawty
 STONE  RIGID                           Umas= 0.1000000D+04
"""
LAW = """$behav  lawty
 iqsc0  IQS_CLB                         fric= 0.3000000D+00
"""
SEE = """$seety
 cdbdy  cdtac  cdcol  behav  anbdy  antac  ancol       alert
 {0}  {1}  BLEUx  iqsc0  {0}  {2}  {3}       0.1000000D-01
"""
HELD = """$bdyty
 {0}{1:9d}
$nodty
 {2}      1
$dofty        [CT......+......AMP..*..cos.(..OMEGA.*.time.+.PHI..)]...*...[RAMPI.....+.....RAMP.*.time]
"""
CONSTANT = " vlocy{:7d}  0.0000000D+00  0.0000000D+00  0.0000000D+00  0.0000000D+00  0.1000000D+01  0.0000000D+00\n"


def row(*values, label="coo"):
    return " " * 29 + "  ".join(f"{label}{k + 1}={v:14.7E}" for k, v in enumerate(values)) + "\n"


def body(kind, contactors, *, at=(0.0, 0.0, 0.0), avrd=0.0, gyrd=0.0, number=1, moments=None):
    """Text of a body; contactors is the text of its block."""
    bulk = f" PLAIN      1  behav  STONE  avrd={avrd:14.7E}  gyrd={gyrd:14.7E}\n"
    if moments is not None:
        bulk += " " * 29 + "  ".join(f"I{k + 1}  ={m:14.7E}" for k, m in enumerate(moments)) + "\n"
    node = "NO3xx" if kind == "RBDY2" else "NO6xx"
    text = f"$bdyty\n {kind}{number:7d}\n$blmty\n{bulk}$nodty\n {node}      1" + " " * 16 + row(*at).lstrip()
    return text + ("" if kind == "RBDY2" else row(0, 0, 0)) + "$tacty\n" + contactors + "$$$$$$\n"


def contactor(kind, *values, label="axe", color="BLEUx"):
    return f" {kind}      1  color  {color}  " + row(*values, label=label).lstrip()


def polyhedron(vertices, faces):
    head = f" POLYR      1  color  BLEUx  nb_vertex={len(vertices):7d}    nb_faces={len(faces):7d}\n"
    ends = "".join(" " * 29 + "  ".join(f"ver{k + 1}={v + 1:7d}       " for k, v in enumerate(f)) + "\n" for f in faces)
    return head + "".join(row(*v) for v in vertices) + ends


def write(folder, bodies, see="", laws=LAW, drives="", states="", bulk=BULK):
    folder.mkdir(exist_ok=True)
    for name, text in (("BODIES", bodies), ("BULK_BEHAV", bulk), ("TACT_BEHAV", laws + see), ("DRV_DOF", drives)):
        (folder / f"{name}.DAT").write_text(text)
    (folder / "DOF.INI").write_text(states)
    return folder


def held(kind, number, dofs=(1, 2, 3)):
    return HELD.format(kind, number, "NO3xx" if kind == "RBDY2" else "NO6xx") + "".join(map(CONSTANT.format, dofs)) + "$$$$$$\n"


DISK, BAR = contactor("DISKx", 0.1, label="byr"), contactor("JONCx", 2.0, 0.05, label=" ax", color="DOWNx")
BOX = [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
SIDES = [[0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4]]
SIDES += [[2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5]]
