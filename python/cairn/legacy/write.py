"""Writer of a scene as a DATBOX folder."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np

from ..base import time_functions
from ..model import bodies
from .contact_laws import LAW_VALUES, law_of, told_by_alert, words_of
from .datbox import ContactLaw
from .scene import UnmappedWarning
from .text import LegacyError, real, triple

HEAD = "! {0}\n\n$steps      0                time= 0.0000000D+00\n\n!" + "-" * 71 + "\n"
TYPES = {"disk": "DISKx", "sphere": "SPHER", "segment": "JONCx", "plane": "PLANx", "tube": "DNLYC", "ring": "xKSID"}
POINTS = {"DISKx": "PT2Dx", "SPHER": "PT3Dx"}  # without a radius


def write_datbox(scene, folder, unmapped="error"):
    """Writes a scene as LMGC90's DATBOX text files, the inverse of read_datbox to their 8 digits. Returns the folder.

    unmapped: for parts without counterpart in the format, or in this writer: "error": raise LegacyError naming all of them, or
    "skip": leave them out with a warning that names all of them. A law that would be read back with other values (Restitution
    with closing=1, cohesive zones with within=0, which LMGC90 does not have) is written as the nearest law, with a warning that
    names these values. Infinite masses become those of a disk or ball of radius 1 (their dofs are driven). In 3D unbounded planes
    become slabs as large as the scene; in 2D the format has none: use cairn.segment instead of a wall.
    """
    if unmapped not in ("error", "skip"):
        raise ValueError(f"unmapped is {unmapped!r}: give 'error' or 'skip'")
    w = _Writer(scene)
    w.collect()
    if w.missed:
        text = "LMGC90's files have no word for this: " + "; ".join(dict.fromkeys(w.missed))
        if unmapped == "error":
            raise LegacyError(text + ". Say unmapped='skip' to write the rest")
        warnings.warn(text, UnmappedWarning, stacklevel=2)
    if w.changed:
        text = "LMGC90's files have no word for this, it is written as what is nearest: " + "; ".join(w.changed)
        warnings.warn(text, UnmappedWarning, stacklevel=2)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in w.files().items():
        (folder / name).write_text(text, encoding="latin-1")
    return folder


class _Writer:
    """Collects the lines of all files of a scene."""

    def __init__(self, scene):
        self.scene, self.dim = scene, scene.dim
        self.type = "RBDY2" if scene.dim == 2 else "RBDY3"
        self.missed, self.changed, self.tables = [], [], {}
        self.body_lines, self.drive_lines, self.state_lines = [], [], []
        self.densities, self.seen = {}, {}  # bulk name: density; species: [(contactor type, colour)]
        self.names = {}

    # -------------------------------------------------------------- names of 5 characters

    def _name(self, kind, text):
        key = kind, text
        if key not in self.names:
            taken = {v for (k, _), v in self.names.items() if k == kind}
            name = text if re.fullmatch(r"\w{5}", text) else (re.sub(r"\W", "", text) + "xxxxx")[:5]
            count = 0
            while name in taken:
                count += 1
                name = f"{kind}{count:04d}"
            self.names[key] = name
        return self.names[key]

    def _species(self, contactors, group):
        """(name of the bulk material, colour) of contactors; names made by read_datbox are recognised."""
        material = contactors.material.name
        words = material.split(" ")
        if not group and len(words) == 3 and all(len(word) == 5 for word in words):
            return words[0], words[1]
        return self._name("M", material), self._name("C", f"{material}{group or ''}")

    # -------------------------------------------------------------- bodies

    def collect(self):
        """Collects the lines of all files."""
        s = self.scene
        if s.periodic is not None:
            self.missed.append("the periodic cell")
        if callable(s.gravity):
            self.missed.append("a gravity that changes with time")
        points = [b.position for b in s.sets if len(b)]
        span = np.ptp(np.concatenate(points), axis=0) if points else np.ones(self.dim)
        self.extent = max(float(np.max(span)), 1e-300)
        number = 0
        for b in s.sets:
            if b.mesh is not None:
                self.missed.append(f"the deformable body {b.mesh.name!r}")
                continue
            if b.damping is not None and np.any(b.damping):
                self.missed.append("damping of bodies")
            if b.surface_velocity is not None:
                self.missed.append("surface velocities of bodies")
            for row in range(len(b)):
                number += 1
                self._body(number, b, row)
        self._laws()

    def _parts(self, number, b, row):
        """[(contactor set, its row)] of a body."""
        found = []
        for c in b.contactors:
            for k in np.flatnonzero(np.asarray(c.body) == row):
                if c.shape in TYPES:
                    found.append((c, int(k)))
                else:
                    instead = ", a wall without end: give cairn.segment" if c.shape == "half_plane" else ""
                    self.missed.append(f"contactor {c.shape} (body {number - 1}){instead}")
        return found

    def _body(self, number, b, row):
        parts = self._parts(number, b, row)
        if not parts:
            self.missed.append(f"body {number - 1}, which has no contactor that could be written")
            return
        frame, shift = self._frame(b, row, parts)
        density = parts[0][0].material.density or 1.0
        bulk, _ = self._species(parts[0][0], b.group)
        self.densities[bulk] = density
        radius, moments = self._inertia(b, row, density)
        lines = self.body_lines
        lines += ["$bdyty", f" {self.type}{number:7d}", "$blmty"]
        first = f" PLAIN{1:7d}  behav  {bulk}  avrd={real(radius)}"
        if self.dim == 2:
            lines.append(first + f"  gyrd={real(moments[0])}")
        else:
            lines += [first, triple(("I1  =", "I2  =", "I3  ="), moments)]
        x = b.position[row] + shift
        lines.append("$nodty")
        if self.dim == 2:
            lines.append(f" NO3xx{1:7d}".ljust(29) + triple(("coo1=", "coo2=", "coo3="), (*x, 0.0)).lstrip())
        else:
            lines.append(f" NO6xx{1:7d}".ljust(29) + triple(("coo1=", "coo2=", "coo3="), x).lstrip())
            lines.append(triple(("coo4=", "coo5=", "coo6="), (0.0, 0.0, 0.0)))
        lines.append("$tacty")
        for k, (c, at) in enumerate(parts, 1):
            self._contactor(k, c, at, b.group)
        lines.append("$$$$$$")
        self._state(number, b, row, frame)
        self._drives(number, b, row)

    def _inertia(self, b, row, density):
        mass, inertia = b.mass[row], b.inertia[row]
        if not np.isfinite(mass):
            return 1.0, np.ones(len(inertia))
        if self.dim == 2:
            turning = np.sqrt(inertia[0] / mass) if np.isfinite(inertia[0]) else 1.0
            return np.sqrt(mass / (np.pi * density)), [turning]
        moments = np.where(np.isfinite(inertia), inertia, mass)
        return np.cbrt(mass / (4 / 3 * np.pi * density)), moments / density

    def _frame(self, b, row, parts):
        """(orientation of a body with segments along local x and normals of planes along local z, shift of its centre [m])."""
        turn = _matrix(self.dim, None if b.rotation is None else b.rotation[row])
        shift = np.zeros(self.dim)
        local = np.eye(self.dim)
        for c, k in parts:
            if c.direction is None:
                continue
            along = c.direction[k][: self.dim] / np.linalg.norm(c.direction[k][: self.dim])
            axis = 0 if self.dim == 2 else 2
            if np.allclose(along, np.eye(self.dim)[axis], atol=1e-14):
                continue
            if len(parts) > 1:
                self.missed.append(f"a body of several contactors one of which, a {c.shape}, is not along its axis")
                continue
            local = _aligned(along, axis)
        frame = turn @ local
        c, k = parts[0]
        if c.shape == "plane" and len(parts) == 1 and c.offset is None:
            shift = -self._thickness() * frame[:, 2]
        return frame, shift

    def _thickness(self):
        return 0.01 * self.extent

    def _contactor(self, k, c, at, group):
        kind = TYPES[c.shape]
        if kind in POINTS and c.radius[at] == 0:
            kind = POINTS[kind]
        _, color = self._species(c, group)
        self.seen.setdefault((c.material.name, group or ""), set()).add((kind, color))
        offset = None if c.offset is None or not np.any(c.offset[at]) else c.offset[at]
        radius = c.radius[at]
        if kind in POINTS.values():
            place = np.zeros(2 if kind == "PT2Dx" else 3) if offset is None else offset
            sizes, offset = list(zip(("coo1=", "coo2=", "coo3="), place)), None
        elif kind == "PLANx":
            half = self._thickness() if offset is None else offset[2]
            sizes = [("axe1=", self.extent), ("axe2=", self.extent), ("axe3=", half)]
            offset = None
        elif kind == "JONCx":
            sizes = [("axe1=", c.direction[at][-1]), ("axe2=", radius)]
        elif kind == "DNLYC":
            sizes = [("High=", min(c.direction[at][-1], self.extent)), ("byrd=", radius)]
        else:
            sizes = [("byrd=", radius)]
            if offset is not None and kind == "DISKx":
                kind = "DISKb"
        if offset is not None and kind != "DISKb":
            self.missed.append(f"a {c.shape} beside the centre of its body")
        head = f" {kind}{k:7d}  color  {color}  "
        labels, values = zip(*sizes)
        self.body_lines.append(head + triple(labels, values).lstrip())
        if kind == "DISKb":
            self.body_lines.append(triple(("coo1=", "coo2="), offset))

    # -------------------------------------------------------------- states and driven dofs

    def _state(self, number, b, row, frame):
        velocity = np.zeros(3 * self.dim - 3) if b.velocity is None else b.velocity[row]
        self.state_lines += ["$bdyty", f" {self.type}{number:9d}", "$nodty"]
        if self.dim == 2:
            angle = np.arctan2(frame[1, 0], frame[0, 0])
            self.state_lines.append(f" NO3xx{1:7d}".ljust(29) + triple(("X(1)=", "X(2)=", "X(3)="), (0, 0, angle)).lstrip())
            self.state_lines.append(triple(("V(1)=", "V(2)=", "V(3)="), velocity))
        else:
            self.state_lines.append(f" NO6xx{1:7d}".ljust(29) + triple(("X(1)=", "X(2)=", "X(3)="), (0, 0, 0)).lstrip())
            self.state_lines.append(triple(("X(4)=", "X(5)=", "X(6)="), (0, 0, 0)))
            self.state_lines.append(triple(("V(1)=", "V(2)=", "V(3)="), velocity[:3]))
            self.state_lines.append(triple(("V(4)=", "V(5)=", "V(6)="), frame.T @ velocity[3:]))
            for name, axis in zip("abg", frame.T):
                self.state_lines.append(triple([f"{name}({k})=" for k in (1, 2, 3)], axis))
        self.state_lines.append("$$$$$$")

    def _drives(self, number, b, row):
        rows = []
        names = bodies.DOFS[self.dim]
        for kind, given in (("vlocy", b.drive), ("force", b.force)):
            for k, name in enumerate(names):
                if (name in b.driven) != (kind == "vlocy"):
                    continue
                value = 0.0 if given is None else self._component(given, row, k, kind)
                if kind == "vlocy" or callable(value) or value != 0:
                    rows.append(self._drive(number, kind, k + 1, value))
        if rows:
            node = "NO3xx" if self.dim == 2 else "NO6xx"
            title = "$dofty  numbr [CT......+......AMP..*..cos.(..OMEGA.*.time.+.PHI..)]...*...[RAMPI.....+.....RAMP.*.time]"
            self.drive_lines += ["$bdyty", f" {self.type}{number:7d}", "$nodty", f" {node}{1:7d}", title, *rows, "$$$$$$", ""]

    def _component(self, given, row, k, kind):
        if isinstance(given, time_functions.Components):
            return given.parts[k] if k < len(given.parts) else 0.0
        if isinstance(given, time_functions.Table):
            values = given.values if given.values.ndim == 2 else given.values[:, None]
            return time_functions.Table(given.times, values[:, k]) if k < values.shape[1] else 0.0
        if isinstance(given, time_functions.Harmonic):
            pick = [np.atleast_1d(x) for x in (given.amplitude, given.mean)]
            amplitude, mean = (float(p[k]) if k < len(p) else 0.0 for p in pick)
            return time_functions.Harmonic(amplitude, given.frequency, mean, given.phase)
        if callable(given):
            self.missed.append(f"a {'velocity' if kind == 'vlocy' else 'force'} that is a Python function (use Table)")
            return 0.0
        return float(np.asarray(given)[row, k])

    def _drive(self, number, kind, component, value):
        head = f" {kind}{component:7d} "
        begin, slope = 1.0, 0.0
        if isinstance(value, time_functions.Ramp):
            value, begin, slope = value.value, value.begin, value.slope
        if isinstance(value, time_functions.Table):
            name = f"d{number}_{component}.dat"
            if (begin, slope) != (1.0, 0.0):
                self.missed.append("a table times a ramp")
            self.tables[name] = "".join(f"{real(t)} {real(v)}\n" for t, v in zip(value.times, value.values))
            return head + "evolution " + name
        numbers = (value, 0.0, 0.0, 0.0) if not callable(value) else None
        if isinstance(value, time_functions.Harmonic):
            numbers = (value.mean, value.amplitude, 2 * np.pi * value.frequency, value.phase)
        if numbers is None:
            self.missed.append("a drive that is a Python function (use Table)")
            numbers = (0.0,) * 4
        return head + " ".join(real(float(v)) for v in (*numbers, begin, slope))

    # -------------------------------------------------------------- laws

    def _laws(self):
        s = self.scene
        species = s.species()
        pairs = list(species)
        self.law_lines, self.see_lines = [], []
        named, alert = {}, getattr(s.legacy, "alert", 0.0) or 0.01 * self.extent
        for i, a in enumerate(pairs):
            for b in pairs[: i + 1]:
                law = s.law_between(a, b)
                if law is None:
                    continue
                within = told_by_alert(law) or alert
                if law not in named:
                    legacy, there = words_of(law)
                    if legacy is None:
                        self.missed.append(there)
                        continue
                    self.changed += _changed(law, legacy, there, within, self.dim)
                    named[law] = f"law{len(named):02d}"
                    head = f" {named[law]}  {legacy:<30}".ljust(40)
                    rows = [[(f"{word:<4}=", there[word]) for word in row] for row in LAW_VALUES[legacy]]
                    text = ["".join(f"{label}{real(v)}  " for label, v in row).rstrip() for row in rows] or [""]
                    self.law_lines += ["$behav", (head + text[0]).rstrip(), *(" " * 40 + t for t in text[1:]), ""]
                self._see(a, b, named[law], within)

    def _see(self, a, b, law, alert):
        round_ = ("DISKx", "SPHER")
        for ta, ca in sorted(self.seen.get(a, ())):
            for tb, cb in sorted(self.seen.get(b, ())):
                sides = [(ta, ca), (tb, cb)]
                points = sum(t in POINTS.values() for t, _ in sides)  # they see each other alone
                if points == 1 or not (points or any(t in round_ for t, _ in sides)):
                    continue
                sides.sort(key=lambda side: side[0] not in round_)
                (t1, c1), (t2, c2) = sides
                self.see_lines += [
                    "$seety",
                    " cdbdy  cdtac  cdcol  behav  anbdy  antac  ancol       alert",
                    f" {self.type}  {t1}  {c1}  {law}  {self.type}  {t2}  {c2}".ljust(54) + real(alert),
                    "",
                ]

    def files(self):
        """{name: text} of the files of the folder."""
        gravity = np.zeros(3)
        if not callable(self.scene.gravity):
            gravity[: self.dim] = self.scene.gravity
        bulk = ["$gravy", " " * 19 + "".join(f"grv{k + 1}={real(g)}  " for k, g in enumerate(gravity)).rstrip()]
        for name, density in self.densities.items():
            bulk += ["$behav  lawty", f" {name}  {'RIGID':<30}".ljust(40) + f"Umas={real(density)}"]
        return {
            "BODIES.DAT": "\n".join(["", *self.body_lines, ""]),
            "BULK_BEHAV.DAT": "\n".join(["! File BEHAVIOUR", *bulk, ""]),
            "TACT_BEHAV.DAT": "\n".join(["", *self.law_lines, *self.see_lines, ""]),
            "DRV_DOF.DAT": "\n".join(["! DOF", *self.drive_lines, ""]),
            "DOF.INI": "\n".join([HEAD.format("DOF"), *self.state_lines, ""]),
            "Vloc_Rloc.INI": HEAD.format("Vloc_Rloc"),
            **self.tables,
        }


def _changed(law, name, given, alert, dim):
    """Texts on values of a law that would be read back differently, beyond the precision of a file."""
    back, _, _ = law_of(ContactLaw(name, name, parameters=given), alert, dim)
    pairs = zip(law.parameter_names, law.values, back.values)
    return [
        f"{what}={mine:g} of law {law!r}, which {name} is read with as {what}={theirs:g}"
        for what, mine, theirs in pairs
        if mine != theirs and not abs(mine - theirs) <= 1e-7 * abs(mine)
    ]


def _matrix(dim, rotation):
    if rotation is None:
        return np.eye(dim)
    if dim == 2:
        c, s = np.cos(rotation), np.sin(rotation)
        return np.array([[c, -s], [s, c]])
    w, x, y, z = rotation / np.linalg.norm(rotation)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _aligned(along, axis):
    """A rotation whose column `axis` is the direction `along`."""
    if len(along) == 2:
        return np.column_stack([along, (-along[1], along[0])])
    other = np.eye(3)[np.argmin(np.abs(along))]
    first = np.cross(other, along)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(along, first), along])
