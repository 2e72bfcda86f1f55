"""How sphinx-gallery makes the pictures of a script of figures/: by its function `main`, not as a program."""

import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from sphinx_gallery.scrapers import figure_rst

from kerrcaustics.draw.space import NoOpenGLError
from kerrcaustics.scripts import FIGURES


def define_only(_conf, script):
    """Keep `if __name__ == "__main__"` of a script from running; its command line is empty."""
    script["example_globals"]["__name__"] = Path(script["src_file"]).stem
    return []


def pictures(_block, script, conf):
    """The PNG files that the `main` of a script makes, put where the gallery looks for them."""
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
