"""Draws the layers of the sources, from the list of check_style.py, and the stages of a step: docs/images/architecture.png."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from check_style import LAYERS, ROOT

STAGES = (  # of a step of NSCD, and the folders of cxx that each calls
    ("predict_configuration", "bodies, meshes"),
    ("compute_free_velocity", "bodies, meshes, soe"),
    ("detect_contacts", "contactors, detection"),
    ("prepare_contacts", "laws, contacts"),
    ("solve_contacts", "solvers"),
    ("update_velocity", "bodies, meshes"),
    ("commit_contacts", "laws, contacts"),
    ("update_configuration", "bodies, meshes"),
)
OUTER = (("python/cairn", "model, run, pre, post, study, cli", "#cfe3f5"), ("bindings", "pybind11, no logic", "#dcebd5"))


def box(ax, x, y, wide, high, title, below="", colour="white"):
    """A box with a title and a smaller line below it."""
    ax.add_patch(plt.Rectangle((x, y), wide, high, facecolor=colour, edgecolor="0.3"))
    ax.text(x + wide / 2, y + high * (0.64 if below else 0.5), title, ha="center", va="center", fontsize=11)
    if below:
        ax.text(x + wide / 2, y + high * 0.28, below, ha="center", va="center", fontsize=9, color="0.3")


figure, (left, right) = plt.subplots(1, 2, figsize=(11, 7.4), layout="constrained", width_ratios=(1.15, 1))
for ax, title in ((left, "a layer uses those below it alone"), (right, "stages of a step of NSCD, and folders of cxx")):
    ax.set(xlim=(0, 10), ylim=(0, 15), title=title)
    ax.axis("off")
for k, (name, told, colour) in enumerate(OUTER):
    box(left, 0, 13.6 - 1.5 * k, 10, 1.3, name, told, colour)
left.add_patch(plt.Rectangle((0, 2.0), 10, 9.9, facecolor="#fbf3dc", edgecolor="0.3"))
left.text(5, 11.5, "cxx", ha="center", va="center", fontsize=11)
left.text(5, 11.0, "fortran, C header: the public calls are in api", ha="center", va="center", fontsize=9, color="0.3")
columns, gap = 3, 0.18
high = 8.5 / -(-len(LAYERS) // columns) - gap
for k, name in enumerate(reversed(LAYERS)):
    row, column = divmod(k, columns)
    box(left, 0.3 + 3.15 * column, 10.6 - high - row * (high + gap), 3.0, high, name)
left.annotate("", (0.12, 2.2), (0.12, 10.6), arrowprops={"arrowstyle": "->", "color": "0.3"})
box(
    left,
    0,
    0.2,
    10,
    1.5,
    "core_f90",
    "kernels on plain arrays: detection, laws, solvers, elements, integrators",
    "#f3d9d4",
)
for k, (name, folders) in enumerate(STAGES):
    y = 13.3 - 1.78 * k
    box(right, 0.8, y, 8.4, 1.35, name, folders, "#fbf3dc")
    if k:
        right.annotate("", (5, y + 1.35), (5, y + 1.78), arrowprops={"arrowstyle": "->", "color": "0.3"})
figure.savefig(ROOT / "docs/images/architecture.png", dpi=90)
