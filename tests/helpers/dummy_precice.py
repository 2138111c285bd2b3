"""A module with the interface of preCICE's Python bindings (version 3) and a partner in the same process.

The partner is a function of time and of what was written last that gives the forces: read data are its answer at the end of a
window, from the last window (explicit) or, window by window, repeated until they no longer change (implicit, Aitken's
under-relaxation left to the factor `relaxation`).
"""

import numpy as np


class Participant:
    """One participant; its partner and scheme are set on the class before it is made."""

    window, windows, implicit, tolerance, relaxation, dimensions, initial = 0.01, 10, False, 1e-10, 1.0, 2, False
    partner = None  # function (t, {data: values}) -> {data: values}
    log, connected, components = None, False, {}  # components: of data that are not vectors

    def __init__(self, name, configuration, rank, size):
        self.name, self.time, self.done, self.left, self.finished = name, 0.0, 0, self.window, False
        self.meshes, self.written, self.answer, self.first, self.sides = {}, {}, {}, True, {}
        self.calls = type(self).log = []

    def get_mesh_dimensions(self, mesh):
        return self.dimensions

    def get_data_dimensions(self, mesh, data):
        return self.components.get(data, self.dimensions)

    def set_mesh_vertices(self, mesh, positions):
        self.meshes[mesh] = np.array(positions)
        return np.arange(len(positions))

    def requires_mesh_connectivity_for(self, mesh):
        return self.connected

    def set_mesh_edges(self, mesh, vertices):
        self.sides[mesh] = np.array(vertices)

    set_mesh_triangles = set_mesh_quads = set_mesh_edges

    def requires_initial_data(self):
        return self.initial

    def initialize(self):
        self.calls.append("initialize")
        self.answer = type(self).partner(0.0, self.written)

    def is_coupling_ongoing(self):
        return self.done < self.windows

    def requires_writing_checkpoint(self):
        asked, self.first = self.implicit and self.first, False
        return asked

    def requires_reading_checkpoint(self):
        return self.again

    def is_time_window_complete(self):
        return self.complete

    def get_max_time_step_size(self):
        return self.left

    def read_data(self, mesh, data, vertices, relative):
        assert 0 <= relative <= self.left * (1 + 1e-12) and not self.finished
        n = len(vertices)
        found = self.answer.get(data, np.zeros((n, self.dimensions)))
        return np.array(found, float)

    def write_data(self, mesh, data, vertices, values):
        assert np.shape(values)[0] == len(vertices)
        self.written[data] = np.array(values)

    def advance(self, dt):
        assert 0 < dt <= self.left * (1 + 1e-12)
        self.left -= dt
        self.again = self.complete = False
        if self.left > 1e-12 * self.window:
            return
        before = self.answer
        self.answer = type(self).partner(self.time + self.window, self.written)
        self.left = self.window
        if self.implicit:
            change = max(np.max(np.abs(self.answer[k] - before.get(k, 0.0))) for k in self.answer)
            size = max(np.max(np.abs(v)) for v in self.answer.values())
            if change > self.tolerance * size:
                self.answer = {k: before.get(k, 0.0) + self.relaxation * (v - before.get(k, 0.0)) for k, v in self.answer.items()}
                self.again = True
                return
        self.complete, self.first = True, True
        self.time, self.done = self.time + self.window, self.done + 1

    def finalize(self):
        self.calls.append("finalize")
        self.finished = True
