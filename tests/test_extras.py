"""Packages of the extras that are missing are named, each with the extra that brings it."""

import json
import os
import re
import subprocess
import sys
import tomllib
from importlib.metadata import requires
from pathlib import Path

import pytest
from command_line import run
from packaging.requirements import Requirement

from kerrcaustics.extras import DEVELOPMENT, EXTRAS, install, missing, needed, require

# What users do that needs a package, and the extra that brings it.
CALLS = {
    "kc.explore(spin=0.9, radius=10.0)": ("anywidget", "notebook"),
    "import kerrcaustics.draw.space": ("pyvista", "space"),
    "kc.PhysicalScale(4e6, 8e3).quantity('time')": ("astropy", "astro"),
    "kc.load('counts.fits')": ("astropy", "astro"),
    "kc.skies.Panorama.read('sky.fits')": ("astropy", "astro"),
    "kc.skies.Panorama.from_healpix(np.ones(48))": ("astropy-healpix", "astro"),
    "kc.skies.tycho2('tycho2.fits')": ("astropy", "catalogues"),
    "kc.skies.Panorama.read('sky.exr')": ("OpenEXR", "exr"),
    "kerrcaustics.draw.scenes.save_light('sky.exr', np.ones((2, 2, 3)))": ("OpenEXR", "exr"),
    "kerrcaustics.films.video.check_film_path(Path('film.mp4'))": ("av", "films"),
    "kc.sweep": ("zarr", "sweep"),
    "with client_of('tcp://127.0.0.1:1'): pass": ("distributed", "sweep"),
}
PROGRAM = """
import sys
sys.modules.update(dict.fromkeys({packages}))
import json
from pathlib import Path
import numpy as np
import kerrcaustics as kc, kerrcaustics.draw.scenes, kerrcaustics.films.video
from kerrcaustics.workers.cluster import client_of
open("sky.exr", "w").close()
for call in {calls}:
    try:
        exec(call)
    except ImportError as error:
        print(json.dumps([call, str(error)]))
"""


@pytest.fixture(scope="module")
def complaints(tmp_path_factory):
    """The message of each call in a process without any of the packages."""
    packages = ["starlette", "uvicorn", "websockets", *(name.replace("-", "_") for name, _ in CALLS.values())]
    program = PROGRAM.format(packages=packages, calls=list(CALLS))
    place = {"cwd": tmp_path_factory.mktemp("run"), "env": {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, **place)
    return dict(map(json.loads, done.stdout.splitlines()))


@pytest.mark.parametrize("call", CALLS)
def test_a_missing_package_names_its_extra(call, complaints):
    package, extra = CALLS[call]
    named = f"The package {package} is missing, for {EXTRAS[extra]}: in a clone of kerrcaustics, {install(extra)}"
    assert complaints[call] == named


def test_every_extra_is_known_and_every_package_of_it():
    extras = {name: set() for name in EXTRAS}
    for requirement in map(Requirement, requires("kerrcaustics") or []):
        for extra in EXTRAS:
            if requirement.marker and requirement.marker.evaluate({"extra": extra}):
                extras[extra].add(requirement.name)
    assert all(extras.values())
    for package, extra in CALLS.values():
        assert package.replace("distributed", "dask").lower() in {name.lower() for name in extras[extra]}


def test_every_extra_is_listed_and_none_is_asked_of_an_index():
    """The package is on none yet."""
    root = Path(__file__).parents[1]
    listed = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert set(EXTRAS) == set(listed) and set(DEVELOPMENT) < set(EXTRAS)
    texts = [
        *root.glob("*.md"),
        *root.glob("docs/*.md"),
        *root.glob("docs/recipes/*.py"),
        *root.glob("kerrcaustics/**/*.py"),
    ]
    asked = [path.name for path in texts if re.search(r"install\b.*kerrcaustics(\[|$)", path.read_text(), re.M)]
    assert len(texts) > 300 and asked == []


def test_several_packages_are_one_line():
    line = missing("explore", "nothing_a", "nothing_b")
    assert line.startswith("The packages nothing-a, nothing-b are missing, for the explorer in a browser: in a clone")
    assert missing("explore", "json") == ""
    require("explore", "json")
    assert needed("explore", "json").loads("1") == 1


@pytest.mark.parametrize(
    ("package", "arguments"),
    [
        ("starlette", ("explore",)),
        ("av", ("film", "star_field")),
        ("OpenEXR", ("render", "x.toml", "--output", "x.exr")),
    ],
)
def test_commands_name_it_too(package, arguments, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, package, None)
    status, out, err = run(capsys, *arguments)
    assert status and not out and err.count("\n") == 1
    assert f"package {package} is missing" in err and "pip install" in err
