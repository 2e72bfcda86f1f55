"""How sphinx-gallery makes pages of scripts: of figures/ by their function `main`, of lessons as they are."""

import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from sphinx_gallery.scrapers import figure_rst, matplotlib_scraper
from sphinx_gallery.sorting import ExampleTitleSortKey, FileNameSortKey

from kerrcaustics.draw.space import NoOpenGLError
from kerrcaustics.scripts import FIGURES


def define_only(_conf, script):
    """Keep `if __name__ == "__main__"` of a script from running; its command line is empty."""
    script["example_globals"]["__name__"] = Path(script["src_file"]).stem
    return []


class order:
    """Lessons one after the other, figures by their titles."""

    def __init__(self, folder):
        self.key = (FileNameSortKey if Path(folder).name == "lessons" else ExampleTitleSortKey)(folder)

    def __call__(self, name):
        return self.key(name)


def pictures(block, script, conf):
    """The pictures of a lesson's cell, or all that the `main` of a figure makes, where the gallery looks for them."""
    if Path(script["src_file"]).parent.name == "lessons":
        return matplotlib_scraper(block, script, conf)
    places = []
    with TemporaryDirectory() as folder:
        try:
            files = FIGURES.run(Path(script["src_file"]).stem, Path(folder))
        except NoOpenGLError as error:
            # The page is made all the same, without its picture.
            print(f"{script['src_file']}: {error}", file=sys.stderr)
            files = []
        for file in files:
            if file.suffix == ".png":
                places.append(next(script["image_path_iterator"]))
                shutil.copy(file, places[-1])
    return figure_rst(places, conf["src_dir"])
