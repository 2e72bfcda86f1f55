"""Try what a wheel promises, in the current folder: the main results, the scripts, and what its extras bring.

    python smoke.py plain      # or an extra, or all

The last line names the versions that were tried.
"""

import math
import subprocess
import sys
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import kerrcaustics as kc
from kerrcaustics.scripts import FIGURES, FILMS, STUDIES

CAMERA = kc.Camera(0.999, 6.03)
SCENE = """spin = [0.5, 0.9]
radius = 10
orders = 1
compute = ["geometry"]
"""


def results() -> None:
    """Numbers of the method's paper, and files that hold them."""
    curves = kc.caustics(CAMERA, orders=2)
    assert abs(math.degrees(curves[1].phi_extent) - 263.0179664) < 1e-6
    images = kc.star_images(CAMERA, (math.radians(77), 0.0), 1)
    assert len(images.index) >= 2
    assert Path("demo/caustics_a0.999_r2.6.png").stat().st_size > 10_000


def scripts() -> None:
    """Figures, films and studies are there, and load."""
    assert len(FIGURES.names()) > 20 and len(STUDIES.names()) > 10 and len(FILMS.names()) > 5
    run("figures", "camera_and_sky")
    assert Path("kerrcaustics-figures/camera_and_sky.png").stat().st_size > 10_000
    STUDIES.load("accuracy")
    FILMS.load("pair_creation").film(4)


def run(*arguments: str) -> None:
    """Run a command of the package."""
    subprocess.run([sys.executable, "-m", "kerrcaustics", *arguments], check=True)


def films() -> None:
    """A film of two frames."""
    from kerrcaustics.films.video import write_pictures

    pictures = [np.zeros((64, 64, 3), np.uint8), np.full((64, 64, 3), 255, np.uint8)]
    write_pictures(Path("film.mp4"), iter(pictures), 25)
    assert Path("film.mp4").stat().st_size > 500


def sweep() -> None:
    """A sweep of two cameras."""
    Path("scene.toml").write_text(SCENE, encoding="utf-8")
    run("sweep", "scene.toml", "--output", "store.zarr")
    assert Path("store.zarr").is_dir()


def astro() -> None:
    """A map of image counts to FITS and back."""
    import_module("astropy_healpix")
    counts = kc.count_map(CAMERA, rows=12, max_index=1)
    counts.to_fits("counts.fits")
    assert np.array_equal(kc.load("counts.fits").counts, counts.counts)


EXTRAS = {
    "space": lambda: import_module("kerrcaustics.draw.space"),
    "catalogues": lambda: import_module("astropy.io.fits"),
    "exr": lambda: import_module("OpenEXR"),
    "astro": astro,
    "films": films,
    "explore": lambda: import_module("kerrcaustics.explorer.server"),
    "notebook": lambda: import_module("anywidget"),
    "sweep": sweep,
    "inference": lambda: import_module("numpyro"),
}


def main(name: str) -> None:
    """Try what every installation has, and the extra of that name."""
    # The kernels were compiled when the wheel was built.
    assert find_spec("ziglang") is None
    results()
    scripts()
    wanted = list(EXTRAS) if name.startswith("all") else [name] if name in EXTRAS else []
    for extra in wanted:
        EXTRAS[extra]()
    print(
        " ".join(f"{package} {version(package)}" for package in ("kerrcaustics", "jax", "numpy", "scipy", "matplotlib"))
    )


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "plain")
