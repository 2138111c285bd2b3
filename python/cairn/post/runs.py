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

    Parameters
    ----------
    path : path-like
        Name of the .vtkhdf file.

    Raises
    ------
    FileError
        If there is no such file, it is truncated, not a run of Cairn or of a later format.
    """

    def contact_network(self, i=-1, loaded=True):
        """Gives the edges of the contact network of an output.

        Parameters
        ----------
        i : int, default -1
            Number of the output.
        loaded : bool, default True
            Takes only contacts that carry an impulse.

        Returns
        -------
        ndarray (m, 2)
            Ids of both bodies.

        Raises
        ------
        FileError
            If the file is damaged.
        """
        step = self[i]
        contacts = step.contacts
        with _from_fields_of(step):
            edges = np.stack([contacts["body_a"], contacts["body_b"]], axis=1)
            return edges[np.any(contacts["impulse"] != 0, axis=1)] if loaded else edges

    def graph(self, i=-1, **options):
        """Makes a networkx graph of the bodies and contacts of an output.

        Parameters
        ----------
        i : int, default -1
            Number of the output.
        **options : optional
            Options of cairn.post.contact_graphs.contact_graph: loaded, dt.

        Returns
        -------
        networkx.Graph
            A node for each body, an edge for each pair in contact.

        Raises
        ------
        FileError
            If the file is damaged.
        """
        from .contact_graphs import contact_graph

        step = self[i]
        with _from_fields_of(step):
            return contact_graph(step, **options)

    def force_chains(self, i=-1, **options):
        """Finds the force chains of an output.

        Parameters
        ----------
        i : int, default -1
            Number of the output.
        **options : optional
            Options of cairn.post.contact_graphs.force_chains: share, along, least, dt.

        Returns
        -------
        list of networkx.Graph
            Chains, the largest first.

        Raises
        ------
        FileError
            If the file is damaged.
        """
        from .contact_graphs import force_chains

        step = self[i]
        with _from_fields_of(step):
            return force_chains(step, **options)

    def measure(self, i=-1, **options):
        """Measures coordination, solid fraction, fabric, stress and others of an output.

        Parameters
        ----------
        i : int, default -1
            Number of the output.
        **options : optional
            Options of cairn.post.measures.measure.

        Returns
        -------
        dict
            The measures by name.

        Raises
        ------
        FileError
            If the file is damaged.
        """
        from .measures import measure

        step = self[i]
        with _from_fields_of(step):
            return measure(step, **options)

    def plot(self, i=-1, what="velocity", **options):
        """Draws an output, coloured by a field of the bodies.

        Parameters
        ----------
        i : int, default -1
            Number of the output.
        what : str or array_like (n,), default "velocity"
            Name of the field, or values of the bodies.
        **options : optional
            Options of cairn.post.plots.plot_step.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.
        """
        from .plots import plot_step

        return plot_step(self[i], what, **options)

    def plot_bonds(self, i=-1, **options):
        """Draws the pairs that laws hold in an output, and those that broke.

        Parameters
        ----------
        i : int, default -1
            Number of the output.
        **options : optional
            Options of cairn.post.frame_plots.plot_bonds.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.
        """
        from .frame_plots import plot_bonds

        return plot_bonds(self[i], **options)

    def plot_force_chains(self, i=-1, **options):
        """Draws the normal impulses of an output as lines.

        Parameters
        ----------
        i : int, default -1
            Number of the output.
        **options : optional
            Options of cairn.post.plots.plot_force_chains.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.
        """
        from .plots import plot_force_chains

        return plot_force_chains(self[i], **options)

    def plot_energy(self, **options):
        """Draws the energy terms over time.

        Parameters
        ----------
        **options : optional
            Options of cairn.post.histories.plot_energy.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.
        """
        from .histories import plot_energy

        return plot_energy(self.history, **options)

    def plot_residual(self, **options):
        """Draws error and iterations of the solver over time.

        Parameters
        ----------
        **options : optional
            Options of cairn.post.histories.plot_residual.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.
        """
        from .histories import plot_residual

        return plot_residual(self.history, **options)

    def plot_history(self, *names, **options):
        """Draws columns of the history over time.

        Parameters
        ----------
        *names : str
            Names of columns; without any the probes, energy and error.
        **options : optional
            Options of cairn.post.histories.plot_history.

        Returns
        -------
        list of matplotlib.axes.Axes
            The axes of the panels.
        """
        from .histories import plot_history

        return plot_history(self, *names, **options)

    def animate(self, path, what="velocity", **options):
        """Writes a .gif or .mp4 of all outputs.

        Parameters
        ----------
        path : path-like
            Name of the file.
        what : str or array_like (n,), default "velocity"
            Name of the field that colours the bodies.
        **options : optional
            Options of cairn.post.films.animate.

        Returns
        -------
        path-like
            Name of the file, as it was given.
        """
        from .films import animate

        return animate(self, path, what, **options)

    def _repr_html_(self):
        from ..base.notebook import of_run

        return of_run(self)


teach(globals())
