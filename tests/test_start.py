"""What commands and calls load: no more than they need."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ENVIRONMENT = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])}
# A process runs commands and calls one after the other, and prints what it has loaded after each.
RUN = """
import json, os, shlex, sys

def command(line):
    from kerrcaustics.cli import main
    sys.argv[1:] = shlex.split(line)
    try:
        main()
    except SystemExit as stop:
        assert not stop.code, line

seen, report = {{}}, sys.stdout
sys.stdout = open(os.devnull, "w")
for name, step in {steps!r}.items():
    exec(step) if "(" in step else command(step)
    seen[name] = [package for package in {packages!r} if package in sys.modules]
print(json.dumps(seen), file=report)
"""
CAMERA = "--spin 0.9 --radius 10"
# In the order of what they need, as nothing is given back.
COMMANDS = {
    "caustics": f"caustics {CAMERA} --orders 1",
    "images": f"images {CAMERA} --star 80 30 --max-index 1",
    "counts": f"counts {CAMERA} --star 80 30 --max-index 1",
    "magnification": f"magnification {CAMERA} --star 80 30 --size 0.5 --max-index 1",
    "tracks": f"tracks {CAMERA} --star-theta 85 --max-index 1",
    "amplification": f"amplification {CAMERA} --star 80 30 --frequency 2 --max-index 1",
    "light-curve": "light-curve --spin 0.9 --radius 100 --inclination 60 --orbit 6 --crossings 1",
    "rings": f"rings {CAMERA} --max-order 1",
}
CALLS = {
    "kc.caustics": "import kerrcaustics as kc; camera = kc.Camera(0.9, 10); kc.caustics(camera, orders=1)",
    "kc.star_images": "kc.star_images(camera, (1.4, 0.5), 1)",
    "kc.image_counts": "kc.image_counts(camera, [(1.4, 0.5)], 1)",
    "kc.magnification": "kc.magnification(camera, (1.4, 0.5), 0.01, max_index=1)",
    "kc.star_tracks": "kc.star_tracks(camera, 1.4, 1)",
    "kc.amplification": "kc.amplification(camera, (1.4, 0.5), [2.0], max_index=1)",
    "kc.light_curve": "kc.light_curve(kc.Camera(0.9, 100, 1.0), 6.0, crossings=1)",
}
# Scenes and the explorer.
PICTURES = {
    "explorer": "from kerrcaustics.explorer import server; from kerrcaustics.explorer.answers import answer; "
    "from kerrcaustics.explorer.state import ExplorerState; answer(1, 'full', ExplorerState())",
    "render": "render disk.toml --output disk.png",
    "render with curves": "render stars.toml --output stars.png",
}
SCENE = """
hole = {spin = 0.6}
camera = {radius = 74, inclination_deg = 80, velocity = "static"}
view = {width = 32, height = 18, field_of_view_deg = 40}
sky = {kind = "none"}
disk = {inner = 4.5, outer = 18.7, emission = {kind = "page-thorne", peak = 6500}}
"""

STARS = """
hole = {spin = 0.9}
camera = {radius = 6}
view = {width = 32, height = 18, field_of_view_deg = 120}
sky = {kind = "stars"}
overlays = {critical_curves = 1, poles = true, labels = true, caption = "t = {time:.1f} M"}
"""

# Plots, tables of results, pages of notebooks, other formats.
ON_REQUEST = {"IPython", "astropy", "matplotlib", "pandas", "skimage", "xarray", "zarr"}
# Parts of SciPy; one that loads most of the others, in 0.4 s.
SCIPY = {"scipy.integrate", "scipy.interpolate", "scipy.ndimage", "scipy.optimize", "scipy.signal", "scipy.spatial"}
NOT_NEEDED = dict.fromkeys(COMMANDS | CALLS, ON_REQUEST | SCIPY | {"PIL", "msgspec", "scipy.special"})
# Airy's functions and Bessel's.
NOT_NEEDED |= dict.fromkeys(("amplification", "kc.amplification"), ON_REQUEST | SCIPY | {"PIL", "msgspec"})
# The photon shell needs elliptic integrals; pictures with stars search for their neighbours.
NOT_NEEDED |= dict.fromkeys(("light-curve", "rings", "kc.light_curve"), ON_REQUEST | SCIPY)
NOT_NEEDED["render"] = ON_REQUEST | SCIPY - {"scipy.spatial"}
NOT_NEEDED["render with curves"] = NOT_NEEDED["render"] - {"matplotlib"}
NOT_NEEDED["explorer"] = ON_REQUEST | SCIPY
# Derivatives, GPUs and the build of the engines need it; and NumPy takes no longer to load than types of arrays.
JAX = {"jax", "jaxlib", "jaxtyping"}


@pytest.fixture(scope="module")
def loaded(tmp_path_factory):
    """The packages that are loaded after each command or call."""
    folder, seen = tmp_path_factory.mktemp("start"), {}
    for name, scene in (("disk", SCENE), ("stars", STARS)):
        (folder / f"{name}.toml").write_text(scene, encoding="utf-8")
    packages = sorted(set.union(JAX, *NOT_NEEDED.values()))
    for steps in (COMMANDS, CALLS, PICTURES):
        done = subprocess.run(
            [sys.executable, "-c", RUN.format(steps=steps, packages=packages)],
            capture_output=True,
            text=True,
            cwd=folder,
            env=ENVIRONMENT,
        )
        assert done.returncode == 0, done.stderr
        seen |= json.loads(done.stdout)
    return {name: set(packages) for name, packages in seen.items()}


@pytest.mark.parametrize("name", NOT_NEEDED)
def test_what_is_not_needed_is_not_loaded(loaded, name):
    assert loaded[name] & NOT_NEEDED[name] == set()


@pytest.mark.parametrize("name", NOT_NEEDED)
def test_neither_jax_nor_its_types_are_loaded(loaded, name):
    assert loaded[name] & JAX == set()
