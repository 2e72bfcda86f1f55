"""Rules for sphinx-gallery's pages of scripts: of figures/ by their function `main`, of lessons as they are."""

import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from sphinx_gallery.scrapers import figure_rst, matplotlib_scraper
from sphinx_gallery.sorting import ExampleTitleSortKey, FileNameSortKey

from kerrcaustics.draw.space import NoOpenGLError
from kerrcaustics.scripts import FIGURES

# In place of a picture that cannot be turned.
MODEL = """
.. raw:: html

    <iframe class="model" src="../models/{name}.html" title="The model, turned by dragging" loading="lazy"></iframe>
"""


def define_only(_conf, script):
    """Keep `if __name__ == "__main__"` of a script from running; its command line is empty.

    Figures import their neighbours.
    """
    source = Path(script["src_file"])
    script["example_globals"]["__name__"] = source.stem
    if is_of_figures(source.parent):
        script["example_globals"]["__package__"] = FIGURES.package()
    return []


def is_of_figures(folder):
    """True for the folder of figures; scripts of others are shown cell by cell."""
    return folder.resolve() == FIGURES.folder


class order:
    """Lessons and how-tos one after the other, figures by their titles."""

    def __init__(self, folder):
        self.key = (ExampleTitleSortKey if is_of_figures(Path(folder)) else FileNameSortKey)(folder)

    def __call__(self, name):
        return self.key(name)


def pictures(block, script, conf):
    """The pictures of a cell, or pictures and models that the `main` of a figure makes, where pages look for them."""
    source = Path(script["src_file"])
    if not is_of_figures(source.parent):
        return matplotlib_scraper(block, script, conf)
    places, models = [], ""
    with TemporaryDirectory() as folder:
        for file in made(source, Path(folder)):
            if file.suffix == ".png":
                places.append(next(script["image_path_iterator"]))
                shutil.copy(file, places[-1])
            if file.suffix == ".html":
                shutil.copy(file, Path(conf["src_dir"]) / "gallery" / "extra" / "models")
                models += MODEL.format(name=file.stem)
    return figure_rst(places, conf["src_dir"]) + models


def made(source, folder):
    """The files that a figure makes in a folder; without OpenGL those that need none."""
    try:
        return FIGURES.run(source.stem, folder)
    except NoOpenGLError as error:
        print(f"{source}: {error}", file=sys.stderr)
        return list(folder.iterdir())
