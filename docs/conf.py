"""Sphinx configuration: MyST pages, docstrings by autodoc."""

import re
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

# warnings of pages that only users of other tools see
suppress_warnings = ["myst.xref_missing"]

sys.path.insert(0, str(ROOT / "docs"))
import tables  # noqa: E402

tables.write(ROOT / "docs" / "api")
