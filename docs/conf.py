"""Sphinx configuration of the documentation."""

import re
import sys
from importlib.metadata import version as installed_version
from pathlib import Path

# For figure_gallery.
sys.path.insert(0, str(Path(__file__).parent))

project = "kerrcaustics"
author = "The kerrcaustics developers"
copyright = "2026, The kerrcaustics developers"
release = version = installed_version("kerrcaustics")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    # Copies MathJax and its fonts beside the pages, so that they need no network.
    "sphinx-mathjax-offline",
    "sphinx_gallery.gen_gallery",
]
# The tables are included in pages.
exclude_patterns = ["_build", "tables"]
# Single backticks in docstrings are code.
default_role = "code"

myst_enable_extensions = ["amsmath", "dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
# The docstrings state the types, with shapes and units.
autodoc_typehints = "none"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_custom_sections = ["Errors"]

# A script runs again when it has changed, or when docs/gallery is removed.
# Films, which are left out below, may be called like figures.
suppress_warnings = ["sphinx_gallery.duplicate_filename"]
sphinx_gallery_conf = {
    "examples_dirs": "../figures",
    "gallery_dirs": "gallery",
    "filename_pattern": ".",
    # Films take minutes.
    "ignore_pattern": r"films",
    "image_scrapers": "figure_gallery.pictures",
    "reset_argv": "figure_gallery.define_only",
    "reset_modules": (),
    "within_subsection_order": "ExampleTitleSortKey",
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "write_computation_times": False,
    "min_reported_time": 3600,
}

html_theme = "furo"
html_title = f"kerrcaustics {release}"
html_copy_source = False


def read_as_text(app, what, name, obj, options, lines):
    """Take docstrings as their authors write them, ahead of napoleon."""
    # |x| is an absolute value, and no substitution.
    lines[:] = [re.sub(r"\|(\S[^|`]*)\|", r"\\|\1\\|", line) for line in lines]
    # An empty start (an escaped line end), or the first line of a property is read as "type: description".
    if what == "property":
        lines.insert(0, "\\")


def write_explorer(app, error):
    """The explorer with a grid of states, as a page that needs no program."""
    if error is None and app.builder.format == "html":
        # Loaded late: JAX has its settings by then.
        from kerrcaustics.explorer.still_page import write_page

        write_page(Path(app.outdir) / "explorer.html")


def setup(app):
    """Connect what this file adds to Sphinx."""
    app.connect("build-finished", write_explorer)
    app.connect("autodoc-process-docstring", read_as_text, priority=400)
