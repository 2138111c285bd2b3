"""A run in the browser, by trame and PyVista: served to this machine alone, and followed while it is being written."""

from __future__ import annotations

import asyncio
import contextlib
import os

import numpy as np

from ...names import listed
from ..drawing import CLASSES, COMPRESSION, TENSION, WALL, field_values, title_of
from ..load import load
from ..plots3d import _palette, add_spheres, choose_window
from .frames import fields_of, frame_of, is_category, limits_of

AXES = ("x", "y", "z")
LOOK_AGAIN = 2.0  # seconds between looks for new outputs of a run that goes on


class Viewer:
    """The picture of a run and what its controls change.

    `show(output, what, forces, axis, cut)` draws an output: what, the field that colours bodies; axis "", "x", "y" or "z" and cut
    in 0..1, the part of the scene below which bodies are shown. `numbers(point)` tells of the body nearest to a point in space.
    """

    def __init__(self, path, what="velocity"):
        choose_window()
        import pyvista

        self.path, self.run = os.fspath(path), load(path)
        if len(self.run) == 0:
            raise ValueError(f"{self.path} holds no output yet")
        self.fields = fields_of(self.run)
        if what not in self.fields:
            raise ValueError(f"there is no field {what!r}; there are {listed(self.fields, what)}")
        self.plotter = pyvista.Plotter(off_screen=True)
        self.plotter.set_background("white")
        self.step, self._limits = None, {}
        self.show(len(self.run) - 1, what)
        self.plotter.camera_position = "xy" if self.run.dim == 2 else [(1.0, -1.6, 0.8), (0, 0, 0), (0, 0, 1)]
        self.plotter.reset_camera()

    def look_again(self):
        """Reads the run once more; returns the number of its outputs."""
        before = len(self.run)
        with contextlib.suppress(OSError):  # between two flushes of its writer a file may not be readable for a moment
            if len(self.run.refresh()) > before:
                self._limits.clear()
        return len(self.run)

    def show(self, output, what="velocity", forces=False, axis="", cut=1.0):
        """Draws an output; see the class."""
        import pyvista

        self.step = step = self.run[output]
        frame = frame_of(step)
        values = np.asarray(field_values(step, what)[0], float)
        classes = is_category(what)
        if what not in self._limits:
            self._limits[what] = limits_of(self.run, what)
        limits, palette = self._limits[what], _palette(classes, None)
        values = values % len(CLASSES) if classes else values
        keep, rows, lines = self._cut(frame, axis, cut)
        opacity = 0.2 if forces and step.dim == 3 else 1.0  # bodies in space hide the forces between them
        self.plotter.clear_actors()
        balls = frame.center[keep], frame.radius[keep], values[frame.row[keep]]
        if step.dim == 2 and len(balls[0]):
            cloud = pyvista.PolyData(balls[0])
            cloud["diameter"], cloud["value"] = 2 * balls[1], balls[2]
            disk = pyvista.Disc(inner=0.0, outer=0.5, c_res=24)
            disks = cloud.glyph(scale="diameter", orient=False, geom=disk)
            self.plotter.add_mesh(
                disks, scalars="value", cmap=palette, clim=limits, lighting=False, show_scalar_bar=False
            )
        else:
            add_spheres(self.plotter, *balls, palette, limits, opacity)
        if rows.any():
            triangles = frame.triangles[rows]
            surface = pyvista.PolyData(frame.points, np.column_stack((np.full(len(triangles), 3), triangles)).ravel())
            surface.cell_data["value"] = values[frame.rows[rows]]
            self.plotter.add_mesh(
                surface, scalars="value", cmap=palette, clim=limits, lighting=step.dim == 3, opacity=opacity,
                show_scalar_bar=False,
            )
        self._lines(frame.walls, WALL, 2.0)
        if forces and len(frame.force):
            size = np.abs(frame.force) / np.abs(frame.force).max()
            for sign, colour in ((1, COMPRESSION), (-1, TENSION)):
                for low, high, width in ((0.0, 0.1, 1.0), (0.1, 0.4, 3.0), (0.4, 2.0, 6.0)):
                    self._lines(frame.forces[lines & (sign * frame.force > 0) & (size >= low) & (size < high)], colour, width)
        title = title_of(step)
        if forces and len(frame.force):
            title += f"\nnormal forces up to {np.abs(frame.force).max():.3g} N: red pushes, blue pulls"
        self.plotter.add_text(title, font_size=9, color="black", name="title")
        if not classes:
            bar = pyvista.Sphere(radius=0.0, center=frame.center[0] if len(frame.center) else (0, 0, 0))
            bar["value"] = np.full(bar.n_points, limits[0])
            label = field_values(step, what)[1]
            self.plotter.add_mesh(
                bar, scalars="value", cmap=palette, clim=limits, opacity=0.0, show_scalar_bar=True,
                scalar_bar_args={"title": label, "vertical": True, "color": "black"},
            )

    def _cut(self, frame, axis, cut):
        """Masks of the round contactors, the triangles and the force lines that lie below the cut."""
        keep, rows, lines = (np.ones(len(each), bool) for each in (frame.radius, frame.rows, frame.force))
        if axis:
            k, place = AXES.index(axis), self.step.drawn["position"]
            if k < place.shape[1] and len(place):
                limit = place[:, k].min() + cut * np.ptp(place[:, k])
                keep, rows = place[frame.row, k] <= limit, place[frame.rows, k] <= limit
                lines = frame.forces[:, :, k].mean(axis=1) <= limit
        return keep, rows, lines

    def _lines(self, ends, colour, width):
        import pyvista

        if len(ends):
            cells = np.column_stack((np.full(len(ends), 2), np.arange(2 * len(ends)).reshape(-1, 2))).ravel()
            self.plotter.add_mesh(
                pyvista.PolyData(ends.reshape(-1, 3), lines=cells), color=colour, line_width=width, lighting=False, pickable=False
            )

    def numbers(self, point):
        """The body nearest to a point (3,) [m] as a list of (name, text), its id first."""
        step = self.step
        place = step.drawn["position"]
        row = int(np.argmin(np.linalg.norm(place - np.asarray(point, float)[: step.dim], axis=1)))
        ids = step.drawn["id"] if "id" in step.drawn else np.arange(len(place))
        told = [("body", str(ids[row])), ("position [m]", ", ".join(f"{x:.4g}" for x in place[row]))]
        for name in self.fields:
            value, label = field_values(step, name)
            told.append((label or name, f"{value[row]:.4g}"))
        return told


def serve(path, what="velocity", port=0, open_browser=True, follow=True):
    """Serve a run to a browser on this machine (address 127.0.0.1) until Ctrl-C.

    port : 0 takes a free one. follow : look for new outputs of a run that goes on. Raises ImportError without trame and PyVista.
    """
    server, _ = application(path, what, follow)

    def ready(**_):
        without = ", --no-browser opens none" if open_browser else ""
        print(f"{path} at http://127.0.0.1:{server.port}/ (Ctrl-C ends it{without})", flush=True)

    server.controller.on_server_ready.add(ready)
    server.start(host="127.0.0.1", port=port, open_browser=open_browser, show_connection_info=False)


def application(path, what="velocity", follow=True):
    """The trame server of a viewer, not started yet, and the Viewer."""
    try:
        from trame.app import get_server
        from trame.ui.vuetify3 import SinglePageLayout
        from trame.widgets import vuetify3 as v3
        from trame_pyvista.ui import plotter_ui
    except ImportError as error:
        raise ImportError("the browser needs trame and PyVista: pip install trame-pyvista trame-vuetify") from error
    viewer = Viewer(path, what)
    server = get_server(name=f"cairn {viewer.path}", client_type="vue3")
    server.cli.allow_abbrev = False
    state, ctrl = server.state, server.controller
    state.update({"output": len(viewer.run) - 1, "last": len(viewer.run) - 1, "what": what, "forces": False, "axis": "",
                  "cut": 1.0, "playing": False, "told": [], "trame__title": os.path.basename(viewer.path)})

    @state.change("output", "what", "forces", "axis", "cut")
    def draw(**_):
        viewer.show(int(state.output), state.what, bool(state.forces), state.axis or "", float(state.cut))
        ctrl.view_update()

    def clicked(point):
        if point is not None:
            state.told = viewer.numbers(point)
            state.flush()

    viewer.plotter.enable_point_picking(clicked, left_clicking=True, show_message=False, show_point=False)

    async def go_on(**_):
        waited = 0.0
        while True:
            await asyncio.sleep(0.1)
            waited += 0.1
            with state:
                if state.playing:
                    state.output = (int(state.output) + 1) % (int(state.last) + 1)
                if follow and waited >= LOOK_AGAIN:
                    waited, at_end = 0.0, state.output == state.last
                    count = viewer.look_again()
                    if count - 1 > int(state.last):
                        state.last = count - 1
                        state.output = state.last if at_end else state.output

    ctrl.on_server_ready.add_task(go_on)
    with SinglePageLayout(server) as layout:
        layout.title.set_text(os.path.basename(viewer.path))
        with layout.toolbar:
            v3.VBtn("{{ playing ? 'stop' : 'play' }}", click="playing = !playing")
            v3.VSlider(v_model=("output",), min=0, max=("last",), step=1, hide_details=True, style="max-width: 260px")
            v3.VSelect(label="colour by", v_model=("what",), items=(viewer.fields,), hide_details=True, style="max-width: 160px")
            v3.VCheckbox(label="forces", v_model=("forces",), hide_details=True)
            axes = ["", *AXES[: viewer.run.dim]]
            v3.VSelect(label="cut", v_model=("axis",), items=(axes,), hide_details=True, style="max-width: 90px")
            v3.VSlider(v_if="axis", v_model=("cut",), min=0, max=1, step=0.01, hide_details=True, style="max-width: 160px")
        with layout.content, v3.VContainer(fluid=True, classes="pa-0", style="position: relative; height: 100%"):
            view = plotter_ui(viewer.plotter, mode="server", add_menu=False, server=server)
            ctrl.view_update = view.update
            ctrl.on_client_connected.add(view.update)
            with v3.VCard(v_if="told.length", style="position: absolute; left: 12px; bottom: 12px", classes="pa-2"):
                v3.VBtn("close", click="told = []", size="small")
                with v3.VTable(density="compact"):
                    server_row = '<tr v-for="(row, i) in told" :key="i"><td>{{ row[0] }}</td><td>{{ row[1] }}</td></tr>'
                    _html(server_row)
    return server, viewer


def _html(text):
    """Plain markup inside a trame layout."""
    from trame.widgets import html

    with html.Tbody() as body:
        body.add_child(text)
