"""Sphinx configuration: MyST pages, docstrings by autodoc."""

import re
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
project = "Cairn"
copyright = "the Cairn authors"
release = re.search(r"project\(Cairn VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "fieldlist"]
myst_heading_anchors = 3
autosummary_generate = True
autodoc_typehints = "description"
html_theme = "furo"
exclude_patterns = ["_build"]

# links that only users of other tools see; templates of programs, with @NAME@ in them
suppress_warnings = ["myst.xref_missing", "misc.highlighting_failure"]

sys.path.insert(0, str(ROOT / "docs"))
import gallery  # noqa: E402
import tables  # noqa: E402

tables.write(ROOT / "docs" / "api")
gallery.write(ROOT / "docs" / "gallery")


def plain(app, what, name, thing, options, lines):
    """Docstrings are text: bars and stars in formulas mark nothing."""
    lines[:] = [line.replace("|", r"\|").replace("**", r"\*\*") for line in lines]


def thumbnails(app, error):
    """The gallery's own pictures, which no page includes as pictures."""
    if error is None and app.builder.format == "html":
        target = Path(app.outdir) / "_static" / "gallery"
        target.mkdir(parents=True, exist_ok=True)
        for picture in (ROOT / "docs" / "gallery").glob("*.jpg"):
            shutil.copy(picture, target)


def setup(app):
    """Called by Sphinx."""
    app.connect("build-finished", thumbnails)
    app.connect("autodoc-process-docstring", plain, priority=100)
