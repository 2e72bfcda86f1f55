"""Kernels as they are called: their arguments are broadcast, and kernels that are stale or absent are one line."""

import ctypes
import json
import math
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
from command_line import run

import kerrcaustics as kc
from kerrcaustics.beams.kernels import build, library
from kerrcaustics.beams.kernels.library import Kernel
from kerrcaustics.beams.kernels.trees import leaves

CAMERA = kc.Camera(0.9, 6.0)
IMAGES = ("images", "--spin", "0.9", "--radius", "6", "--star", "80", "166")
SKIES = "swatches", "picture"
STALE = "The kernels are older than their sources: run `make kernels`."
ABSENT = "The kernels are not compiled: run `make kernels`, or install the package."


@pytest.fixture
def objects(tmp_path, monkeypatch):
    """A copy of the folder of kernels, in its place; nothing of theirs that was loaded before is used."""
    copy = shutil.copytree(library.OBJECTS, tmp_path / "objects")
    monkeypatch.setattr(library, "OBJECTS", copy)
    forget()
    yield copy
    forget()


def forget():
    for kept in (library.kernel, library.catalogue):
        kept.cache_clear()


def made_stale(objects):
    catalogue = objects / library.CATALOGUE
    catalogue.write_text(json.dumps(json.loads(catalogue.read_text()) | {"digest": "another"}))


def removed(objects):
    shutil.rmtree(objects)


@pytest.mark.parametrize(("spoil", "line"), [(made_stale, STALE), (removed, ABSENT)])
def test_stale_and_absent_kernels_are_one_line(objects, capsys, spoil, line):
    assert kc.trace_rays(CAMERA, np.eye(3)).escaped.any()
    forget()
    spoil(objects)
    for use in (lambda: library.kernel("depth"), library.level, lambda: kc.trace_rays(CAMERA, np.eye(3))):
        with pytest.raises(RuntimeError) as raised:
            use()
        assert str(raised.value) == line
    status, out, err = run(capsys, *IMAGES)
    assert (status, out) == (1, "") and line in err and err.count("\n") == 1 and "Traceback" not in err
    assert f"Kernels: {line}" in run(capsys, "doctor")[1].replace("\n", " ")


def test_a_level_that_is_not_there_is_refused_by_name():
    code = "from kerrcaustics.__main__ import main; main()"
    environment = os.environ | {"KERRCAUSTICS_LEVEL": "x86-64-v9"}
    done = subprocess.run([sys.executable, "-c", code, *IMAGES], env=environment, capture_output=True, text=True)
    line = f"KERRCAUSTICS_LEVEL must be one of {', '.join(library.available_levels())}, but is 'x86-64-v9'."
    assert (done.returncode, done.stdout) == (1, "") and line in done.stderr and done.stderr.count("\n") == 1


def test_every_level_can_be_chosen(monkeypatch):
    monkeypatch.delenv("KERRCAUSTICS_LEVEL", raising=False)
    assert library.level() == library.available_levels()[-1]
    for name in library.available_levels():
        monkeypatch.setenv("KERRCAUSTICS_LEVEL", name)
        assert library.level() == name


def test_without_a_level_for_the_processor_none_can_be_chosen(objects, monkeypatch):
    for path in objects.glob(library.library_name("*")):
        path.unlink()
    for chosen in ("", "x86-64-v3"):
        monkeypatch.setenv("KERRCAUSTICS_LEVEL", chosen)
        with pytest.raises(RuntimeError, match="no kernels for this processor: run `make kernels`"):
            library.level()


def test_arguments_are_broadcast():
    x, y = np.array([[-0.6], [-0.7]]), np.array([0.1, 0.2, 0.3])
    frame, kernel = CAMERA.frame(), library.kernel("rays_sky")
    apart = [[kernel(frame, (a, b, 0.5)) for b in y] for a in x[:, 0]]
    together = kernel(frame, (x, y, 0.5))
    assert together.status.shape == (2, 3) and together.direction.shape == (2, 3, 3)
    rows = [[list(leaves(one)) for one in row] for row in apart]
    for i, values in enumerate(leaves(together)):
        np.testing.assert_array_equal(values, [[one[i] for one in row] for row in rows])


def test_no_rays_are_empty_arrays():
    none = library.kernel("beams_sky")(CAMERA.frame(), tuple(np.empty((3, 0))))
    assert none.status.shape == (0,) and none.direction.shape == (0, 3) and none.status.dtype == np.int8
    # Those who call it take any shape without entries.
    for engine in ("auto", "integrated"):
        beams = kc.trace_beams(CAMERA, np.empty((2, 0, 3)), engine)
        assert beams.error.shape == (2, 0) and beams.jacobian.shape == (2, 0, 2, 2)


def inputs(name, rng, count=301):
    """Numbers and columns for a kernel of rays: directions of a camera, a radius or a crossing, and more."""
    camera = kc.Camera(0.93, 5.0, 1.1 if "equator" not in name else math.pi / 2)
    sky = rng.normal(size=(count, 3))
    sky /= np.linalg.norm(sky, axis=1)[:, None]
    numbers = [float(number) for number in leaves(camera.frame())]
    columns = [sky]
    if "integrated" in name:
        numbers.append(1e-10)
        columns.append(np.ones(count))
    if name.startswith("deep"):
        columns.append(rng.uniform(0.01, 1, count))
    if name.endswith("plane"):
        numbers.append(1.0)
    if name.endswith("sphere"):
        columns += [rng.uniform(6, 30, count), np.zeros(count)]
    return numbers, columns


def inputs_of_sky(name, rng, count=301):
    """The same for a kernel of a sky, and its tables: footprints of all shapes."""
    sky = rng.normal(size=(3, count))
    columns = [*sky / np.linalg.norm(sky, axis=0), *0.03 * rng.normal(size=(4, count)), 0.01 * rng.uniform(size=count)]
    limits = [1e-6, 16.0, 1.0, 0.5]
    if name == "swatches":
        return [7.0, 10.0, 0.2, 0.0, 0.1, 0.2, 0.3, *limits], columns, None, [rng.uniform(size=(8, 12))]
    # Levels of 8 and 4 rows, with their margins.
    _, channels, dtype = name.split("_")
    tables = [rng.uniform(size=(240, int(channels))).astype(dtype), np.array([[0.0, 8.0], [180.0, 4.0]])]
    return [8.0, 2.0, *np.eye(3).ravel(), *limits], columns, None, tables


def assert_bits_are_equal(names, folder):
    """The kernels of all instruction sets that the processor has, whose lanes differ in number, for the same rays."""
    levels = library.levels_here()
    build.build_all(folder, levels=levels, chosen=names)
    about = json.loads((folder / library.CATALOGUE).read_text())["kernels"]
    loaded = {level: ctypes.CDLL(str(folder / library.library_name(level))) for level in levels}
    for name in names:
        given = (inputs_of_sky if name.startswith(SKIES) else inputs)(name, np.random.default_rng(5))
        first, *others = (Kernel(getattr(loaded[level], name), about[name]).on_rays(*given) for level in levels)
        # Of some rays something is known; prospects are flags alone.
        assert any((np.isfinite(values) if values.dtype == float else values).any() for values in leaves(first))
        for other in others:
            for one, same in zip(leaves(first), leaves(other), strict=True):
                # Of a NaN, bits are free.
                bits = [np.where(np.isnan(values), np.nan, values).tobytes() for values in (one, same)]
                assert bits[0] == bits[1]


def test_instruction_sets_give_the_same_bits(tmp_path):
    assert_bits_are_equal(["rays_sky", "swatches", "picture_3_f2"], tmp_path / "objects")


@pytest.mark.slow
def test_all_kernels_of_rays_and_skies_give_the_same_bits(tmp_path):
    kinds = ("rays", "beams", "short", "integrated", "survey", "prospects", "deep", *SKIES)
    names = [name for name in library.catalogue()["kernels"] if name.startswith(kinds)]
    assert len(names) > 40
    assert_bits_are_equal(names, tmp_path / "objects")
