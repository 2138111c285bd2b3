"""A run with its measures and pictures."""

import contextlib

import numpy as np

from ..base.errors import FileError
from ..files.reader import MissingField, StoredRun
from ..names import teach


@contextlib.contextmanager
def _from_fields_of(step):
    """Context for quantities computed from fields that every run holds: a missing or invalid field means a damaged file."""
    path, remedy = step.run.path, "copy it again from where it was made"
    try:
        yield
    except MissingField as error:
        raise FileError(path, f"the file is damaged: {error.args[0]}", remedy) from error
    except ValueError as error:
        for fields in (step.bodies, step.nodes, step.contacts):
            for name in fields:
                if not np.all(np.isfinite(fields[name])):
                    told = f"output {step.index} holds values of '{name}' that are no numbers ({error})"
                    raise FileError(path, told, remedy) from error
        raise


class Run(StoredRun):
    """A run on disk: `len(run)` outputs, `run[i]`, `run.at(time)`, `run.times`, `run.history`, pictures.

    Arrays are read when they are asked for. `run.refresh()` shows what a simulation still running has added.
    """

    def contact_network(self, i=-1, loaded=True):
        """Edges of the contact network of output i: ids of both bodies, shape (m, 2).

        loaded : only contacts that carry an impulse.
        """
        step = self[i]
        contacts = step.contacts
        with _from_fields_of(step):
            edges = np.stack([contacts["body_a"], contacts["body_b"]], axis=1)
            return edges[np.any(contacts["impulse"] != 0, axis=1)] if loaded else edges

    def measure(self, i=-1, **options):
        """Coordination, solid fraction, fabric, stress ... of output i: a dict. See `measures.measure`."""
        from .measures import measure

        step = self[i]
        with _from_fields_of(step):
            return measure(step, **options)

    def plot(self, i=-1, what="velocity", **options):
        """Draw output i coloured by a field of the bodies; returns a matplotlib Axes. See `plots.plot_step`."""
        from .plots import plot_step

        return plot_step(self[i], what, **options)

    def plot_bonds(self, i=-1, **options):
        """Draw the pairs that laws hold in output i, and those that broke. See `frame_plots.plot_bonds`."""
        from .frame_plots import plot_bonds

        return plot_bonds(self[i], **options)

    def plot_force_chains(self, i=-1, **options):
        """Draw the normal impulses of output i as lines. See `plots.plot_force_chains`."""
        from .plots import plot_force_chains

        return plot_force_chains(self[i], **options)

    def plot_energy(self, **options):
        """Draw the energy terms over time. See `histories.plot_energy`."""
        from .histories import plot_energy

        return plot_energy(self.history, **options)

    def plot_residual(self, **options):
        """Draw error and iterations of the solver over time. See `histories.plot_residual`."""
        from .histories import plot_residual

        return plot_residual(self.history, **options)

    def plot_history(self, *names, **options):
        """Draw columns of the history over time, without names the probes, energy and error. See `histories.plot_history`."""
        from .histories import plot_history

        return plot_history(self, *names, **options)

    def animate(self, path, what="velocity", **options):
        """Write a .gif or .mp4 of all outputs. See `films.animate`."""
        from .films import animate

        return animate(self, path, what, **options)

    def _repr_html_(self):
        from ..base.notebook import of_run

        return of_run(self)


teach(globals())
