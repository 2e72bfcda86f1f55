"""How sphinx-gallery makes the pictures of a script of figures/: by its function `main`, not as a program."""

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

from sphinx_gallery.scrapers import figure_rst

from kerrcaustics.scripts import FIGURES


def define_only(_conf, script):
    """Keep `if __name__ == "__main__"` of a script from running; its command line is empty."""
    script["example_globals"]["__name__"] = Path(script["src_file"]).stem
    return []


def pictures(_block, script, conf):
    """The PNG files that the `main` of a script makes, put where the gallery looks for them."""
    places = []
    with TemporaryDirectory() as folder:
        for file in FIGURES.run(Path(script["src_file"]).stem, Path(folder)):
            if file.suffix == ".png":
                places.append(next(script["image_path_iterator"]))
                shutil.copy(file, places[-1])
    return figure_rst(places, conf["src_dir"])
