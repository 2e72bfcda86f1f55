"""Sphinx configuration of the documentation."""

import logging
import os
import re
import sys
from importlib import import_module
from importlib.metadata import version as installed_version
from pathlib import Path

from docutils import nodes

# For figure_gallery, and for the lists that pages show.
sys.path.insert(0, str(Path(__file__).parent))

# It says of every device of other makers that it is not there.
logging.getLogger("jax._src.xla_bridge").setLevel(logging.WARNING)
# It reports each part of each font that it embeds.
logging.getLogger("fontTools").setLevel(logging.WARNING)

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
# The tables are included in pages; lessons become the tutorial, recipes how-tos; the paper is no page.
exclude_patterns = ["_build", "tables", "fields", "lessons", "recipes", "paper"]
# Single backticks in docstrings are code.
default_role = "code"

myst_enable_extensions = ["amsmath", "dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
# The docstrings state the types, with shapes and units.
autodoc_typehints = "none"
# As the source writes them: no place of a module on the machine that built the page.
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_custom_sections = ["Errors"]

# A script runs again when it has changed, or when its pages (docs/gallery, docs/howto, docs/notebooks, docs/tutorial)
# are removed. All figures take minutes, all others two: with KERRCAUSTICS_DOCS=quick no script runs, and its page has
# no pictures.
quick = os.environ.get("KERRCAUSTICS_DOCS") == "quick"
if not quick:
    # Sphinx defines it: the pages show models in space only where there are some.
    tags.add("figures")  # noqa: F821
# Films, which are left out below, may be called like figures.
suppress_warnings = ["sphinx_gallery.duplicate_filename"]
sphinx_gallery_conf = {
    "examples_dirs": ["lessons", "recipes", "fields", "../figures"],
    "gallery_dirs": ["tutorial", "howto", "notebooks", "gallery"],
    "filename_pattern": "(?!)" if quick else ".",
    # Of a cell whose last line is a result the notebook shows its page.
    "capture_repr": ("_repr_html_", "__repr__"),
    # Axes and lines that a call returns are no result.
    "ignore_repr_types": r"matplotlib|list|tuple|NoneType|int|str",
    # Films take minutes.
    "ignore_pattern": r"films",
    "image_scrapers": "figure_gallery.pictures",
    "reset_argv": "figure_gallery.define_only",
    "reset_modules": (),
    "within_subsection_order": "figure_gallery.order",
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "write_computation_times": False,
    "min_reported_time": 3600,
}

html_theme = "furo"
html_title = f"kerrcaustics {release}"
html_copy_source = False
html_static_path = ["style", "clips"]
# Models in space, which figure_gallery puts there.
html_extra_path = ["gallery/extra"]
(Path(__file__).parent / "gallery" / "extra" / "models").mkdir(parents=True, exist_ok=True)
html_css_files = ["pages.css"]
html_js_files = ["copy.js"]


def read_as_text(app, what, name, obj, options, lines):
    """Take docstrings as their authors write them, ahead of napoleon."""
    # |x| is an absolute value, and no substitution.
    lines[:] = [re.sub(r"\|(\S[^|`]*)\|", r"\\|\1\\|", line) for line in lines]
    # An empty start (an escaped line end), or the first line of a property is read as "type: description".
    if what == "property":
        lines.insert(0, "\\")


def write_commands(app, page, source):
    """Put what the commands say of themselves into the page of the commands."""
    if page == "commands":
        from kerrcaustics.cli import with_all_commands

        reported = with_all_commands().generate_docs(output_format="rst").partition("**Commands:**")[2]
        # A usage of its own begins with the command, which is put before it again.
        source[0] = source[0].replace("COMMANDS", reported.replace("kerrcaustics study kerrcaustics", "kerrcaustics"))


# Lists made from what declares them: by page and by the comment that each replaces, its module and function.
LISTS = {
    "architecture": {"modules": ("module_list", "module_list")},
    "figures_of_the_paper": {"figures": ("figure_list", "paper_figures")},
    "films": {"films": ("figure_list", "film_list")},
    "plots": {"plots": ("plot_list", "plot_list")},
    "results": {"results": ("result_list", "result_list")},
    "scene_files": {"keys": ("kerrcaustics.scene_files.key_tables", "key_tables")},
    "studies": {"times": ("kerrcaustics.cli.study_list", "time_table")},
    "sweeps": {
        "keys": ("kerrcaustics.sweeps.key_tables", "scene_table"),
        "variables": ("kerrcaustics.sweeps.key_tables", "variable_table"),
    },
}


def write_lists(app, page, source):
    """Put the lists of a page in the place of their comments."""
    for comment, (module, function) in LISTS.get(page, {}).items():
        made = getattr(import_module(module), function)()
        source[0] = source[0].replace(f"<!-- {comment} -->", made)


# Of links and clips that lead to a file of the repository where a page is read there: the place in the built pages.
BUILT = {
    r"\]\((\.\./figures|recipes|lessons|fields)/\)": lambda link: f"]({GALLERIES[link[1]]}/index.rst)",
    r"\]\((\.\./figures|recipes|lessons|fields)/(\w+)\.py\)": lambda link: f"]({GALLERIES[link[1]]}/{link[2]}.rst)",
    r'src="clips/': lambda _: 'src="_static/',
    r"\[([\w ]+)\]\(\.\./kerrcaustics/explorer/still_page\.py\)": lambda link: f'<a href="explorer.html">{link[1]}</a>',
}
GALLERIES = {"../figures": "gallery", "recipes": "howto", "lessons": "tutorial", "fields": "notebooks"}


def lead_to_built_pages(app, page, source):
    """Let links to scripts and clips lead to the pages made from them."""
    for found, built in BUILT.items():
        source[0] = re.sub(found, built, source[0])


def read_again(app, env, added, changed, removed):
    """Pages that depend on more than their own file."""
    return ["commands", *LISTS]


def keep_numbers_whole(app, doctree, page):
    """No line ends within a number such as 1e-10."""
    for text in list(doctree.findall(nodes.Text)):
        if isinstance(text.parent, nodes.literal | nodes.literal_block | nodes.math | nodes.math_block):
            continue
        whole = re.sub(r"(?<=\de)-(?=\d)", "-\u2060", text)
        if whole != text:
            text.parent.replace(text, nodes.Text(whole))


def write_explorer(app, error):
    """The explorer in one file."""
    if error is None and app.builder.format == "html":
        # Loaded late: JAX has its settings by then.
        from kerrcaustics.explorer.still_page import write_page

        write_page(Path(app.outdir) / "explorer.html")


def setup(app):
    """Connect what this file adds to Sphinx."""
    app.connect("source-read", write_commands)
    app.connect("source-read", write_lists)
    app.connect("source-read", lead_to_built_pages)
    app.connect("env-get-outdated", read_again)
    app.connect("doctree-resolved", keep_numbers_whole)
    app.connect("build-finished", write_explorer)
    app.connect("autodoc-process-docstring", read_as_text, priority=400)
