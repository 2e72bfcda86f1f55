"""Sweeps: scenes, quantities, and stores that survive what can happen to them."""

import errno
import hashlib
import json
import math
import os
import random
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import psutil
import pytest
import xarray
import zarr
from command_line import run
from scipy.interpolate import make_interp_spline

import kerrcaustics as kc
from kerrcaustics.sweeps import engine
from kerrcaustics.sweeps.quantities import computed, dimensions, variables
from kerrcaustics.sweeps.scene import Range, Scene
from kerrcaustics.sweeps.store import Store

PLAIN = "spin = [0.5, 0.9]\nradius = [3.0, 4.0, 6.0]\norders = 1\nblock = 2\ncompute = ['areas']\ntitle = 'Schön'\n"
EVERYTHING = ("geometry", "cusps", "areas", "curves", "counts", "magnification")


def written(folder, text, name="scene.toml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def scene(tmp_path):
    return kc.read_scene(written(tmp_path, PLAIN))


def files(store):
    """Every file of a store, by its content."""
    paths = sorted(path for path in Path(store).rglob("*") if path.is_file())
    return {str(path.relative_to(store)): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def opened(path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return xarray.open_zarr(path)


@pytest.fixture
def quick(monkeypatch):
    """Numbers that cost nothing, in place of the physics; the list of points that were computed."""
    calls = []

    def numbers(scene, spin, radius, inclination):
        calls.append((spin, radius, inclination))
        if radius < 1:
            raise ValueError("too close")
        sizes = {name: len(values) for name, values in dimensions(scene).items()}
        seed = np.random.default_rng([int(1e6 * spin), int(1e6 * radius)])
        return {v.name: seed.integers(0, 99, [sizes[dim] for dim in v.dims]).astype(v.dtype) for v in variables(scene)}

    monkeypatch.setattr(engine, "computed", numbers)
    return calls


def test_scene_file_says_all(tmp_path):
    text = """
        title = "all"
        spin = {from = 0, to = 0.9, count = 4}
        radius = {from = 2, to = 200, count = 3, spacing = "log"}
        inclination = [90, 60.0]
        velocity = "fiducial"
        orders = 2
        compute = ["areas", "counts"]
        curve_points = 16
        map_rows = 6
        directions = 100
        tolerance = 1e-9
        block = 3
    """
    scene = kc.read_scene(written(tmp_path, text))
    assert scene.shape == (4, 3, 2)
    assert np.allclose(scene.values("spin"), [0, 0.3, 0.6, 0.9]) and np.allclose(scene.values("radius"), [2, 20, 200])
    assert scene.values("inclination").tolist() == [60, 90]
    expected = Scene(
        Range(0, 0.9, 4),
        Range(2, 200, 3, "log"),
        [90, 60],
        "fiducial",
        2,
        ("areas", "counts"),
        16,
        6,
        100,
        1e-9,
        3,
        "all",
    )
    assert scene == expected
    least = kc.read_scene(written(tmp_path, "spin = 0.5\nradius = 6"))
    assert least.shape == (1, 1, 1) and least.values("inclination").tolist() == [90]


BAD = {
    "spin = {from = 0, to = 1, count = 'x'}\nradius = 3": "spin.count: expected `int`, got `str`",
    "spin = {from = 0, count = 2}\nradius = 3": "spin: missing key `to`",
    "spin = {from = 0, to = 0.5, count = 2, by = 1}\nradius = 3": "spin: unknown key `by`",
    "spin = {from = 0, to = 0.5, count = 2, spacing = 'even'}\nradius = 3": "spin.spacing: invalid enum value 'even', "
    "expected linear or log",
    "spin = 'fast'\nradius = 3": "spin: expected `float | table | array`, got `str`",
    "spin = [0.1, 'fast']\nradius = 3": "spin[1]: expected `float`, got `str`",
    "spin = 0.5": "missing key `radius`",
    "spin = 0.5\nradius = 3\ncolour = 1": "unknown key `colour`",
    "spin = 0.5\nradius = 3\norders = 2.5": "orders: expected `int`, got `float`",
    "spin = 0.5\nradius = 3\norders = 0": "orders must be from 1 to 10, but is 0",
    "spin = 0.5\nradius = 3\norders = 8\ncompute = ['counts']": "orders must be 7 at most where counts are computed",
    "spin = 0.5\nradius = 3\ncompute = ['mass']": "compute[0]: invalid enum value 'mass', expected geometry or cusps",
    "spin = 0.5\nradius = 3\ncompute = []": "compute must be a list of different quantities",
    "spin = 0.5\nradius = 3\ncompute = ['areas', 'areas']": "compute must be a list of different quantities",
    "spin = 0.5\nradius = 3\nvelocity = 'warp'": "velocity: invalid enum value 'warp', expected circular",
    "spin = 0.5\nradius = 3\ntolerance = 1": "tolerance must be in [1e-14, 1e-2], but is 1",
    "spin = 0.5\nradius = 3\nblock = 0": "block must be from 1 to 10000, but is 0",
    "spin = [0.5, 1.0]\nradius = 3": "spin must be in [0, 1), but is 1.0",
    "spin = 0.5\nradius = -3": "radius must be more than 0, but is -3.0",
    "spin = 0.5\nradius = inf": "radius must be more than 0, but is inf",
    "spin = []\nradius = 3": "spin must be a list of one value or more, but is []",
    "spin = 0.5\nradius = [3, 3]": "radius must be values that differ",
    "spin = 0.5\nradius = 3\ninclination = 200": "inclination must be in [0, 180] degrees, but is 200.0",
    "spin = {from = 0, to = 0.5, count = 0}\nradius = 3": "spin.count must be from 1 to",
    "spin = {from = 0.5, to = 0.1, count = 3}\nradius = 3": "spin must be values that differ, from the least",
    "spin = 0.5\nradius = {from = 0, to = 9, count = 3, spacing = 'log'}": "radius.from and radius.to must be",
    "spin = {from = 0, to = 0.9, count = 3000}\nradius = {from = 2, to = 9, count = 3000}": "the number of points",
    "spin = 0.5 radius = 3": "line 1",
}


@pytest.mark.parametrize("text", BAD)
def test_bad_scene_is_one_line_that_names_the_place(text, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path, text)
    status, out, err = run(capsys, "sweep", path)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert err.startswith(f"kerrcaustics: Scene {path}: ") and BAD[text] in err
    assert list(tmp_path.iterdir()) == [path]


# Extents and circuits of a = 0.999 at r = 6.03 by two other tracers, in degrees, to the digits given.
KNOWN = {
    "theta_extent": [0.4233, 71.83, 131.75],
    "phi_extent": [0.4511, 263.02, 1876.432],
    "circuits": [0.0013, 0.731, 5.212],
    "phi_min": [167.4713, 48.128, -1426.497],
    "phi_max": [167.9224, 311.146, 449.935],
}
DIGITS = {
    "theta_extent": [4, 2, 2],
    "phi_extent": [4, 2, 3],
    "circuits": [4, 3, 3],
    "phi_min": [4, 3, 3],
    "phi_max": [4, 3, 3],
}


@pytest.fixture(scope="module")
def at_603(tmp_path_factory):
    path = tmp_path_factory.mktemp("sweep") / "at_603.zarr"
    scene = Scene(0.999, 6.03, orders=3, compute=EVERYTHING, map_rows=8, directions=512, curve_points=600)
    assert kc.sweep(scene, path).failures == ()
    return opened(path).load().isel(spin=0, radius=0, inclination=0)


def test_store_holds_the_known_numbers(at_603):
    for name, numbers in KNOWN.items():
        for value, number, digits in zip(at_603[name].values, numbers, DIGITS[name], strict=True):
            assert abs(value - number) <= 0.51 * 10.0**-digits, name
    assert at_603.cusp_count.values.tolist() == [4, 4, 4] and at_603.closed.values.tolist() == [1, 1, 1]
    assert at_603.status == 1


def test_store_holds_what_the_functions_return(at_603):
    camera = kc.Camera(0.999, 6.03)
    for i, caustic in enumerate(kc.caustics(camera, 3, tolerance=1e-10)):
        for name in ("theta_min", "theta_max", "phi_min", "phi_max", "theta_extent", "phi_extent"):
            assert at_603[name][i] == math.degrees(getattr(caustic, name))
            assert math.degrees(caustic.error) <= at_603[f"{name}_error"][i] <= 2.01 * math.degrees(caustic.error)
        assert at_603.circuits[i] == caustic.circuits and at_603.residual[i] == caustic.residual
        cusps = np.degrees([cusp.celestial for cusp in caustic.cusps])
        assert np.array_equal(np.stack([at_603.cusp_theta[i, :4], at_603.cusp_phi[i, :4]], axis=-1), cusps)
        assert np.isnan(at_603.cusp_theta[i, 4:]).all() and (at_603.cusp_error[i, :4] > 0).all()
        filled = int(np.isfinite(at_603.curve_theta[i]).sum())
        assert filled == min(600, len(caustic.sky)) and np.isfinite(at_603.curve_sky[i, :filled]).all()
        stored = np.stack([at_603.curve_theta[i, :filled], at_603.curve_phi[i, :filled]], axis=-1)
        whole = np.degrees(caustic.celestial)
        assert np.array_equal(stored, whole[np.arange(filled) * len(whole) // filled])
    world = kc.count_map(camera, 2, 8)
    assert np.array_equal(at_603.image_count, world.counts)
    assert np.allclose(np.radians(at_603.theta), world.theta, rtol=0, atol=1e-15)
    assert np.array_equal(at_603.image_count_on_caustic, world.on_caustic)
    assert np.allclose(np.radians(at_603.phi), world.phi, rtol=0, atol=1e-15)


def test_every_variable_has_units_and_an_error_beside_it(at_603):
    exact = {"cusp_count", "closed", "residual", "image_count", "image_count_on_caustic", "status", "reason"}
    shared = {
        "cusp_theta": "cusp",
        "cusp_phi": "cusp",
        "curve_theta": "curve",
        "curve_phi": "curve",
        "curve_sky": "curve",
    }
    for name, variable in at_603.variables.items():
        assert "units" in variable.attrs, name
    for name in set(at_603.data_vars) - exact:
        if not name.endswith("_error"):
            assert f"{shared.get(name, name)}_error" in at_603, name
    assert at_603.attrs["version"] == kc.__version__ and at_603.attrs["engine"] == "auto"
    assert at_603.attrs["tolerance"] == 1e-10 and json.loads(at_603.attrs["scene"])["spin"] == 0.999


def test_store_becomes_a_netcdf_file(at_603, tmp_path):
    at_603.to_netcdf(tmp_path / "s.nc", engine="h5netcdf")
    assert xarray.load_dataset(tmp_path / "s.nc", engine="h5netcdf").equals(at_603)


def test_area_of_the_critical_curves_of_schwarzschild():
    """Rings at the angles that another program found, to 1e-6 degrees."""
    scene = Scene(0.0, 6.03, velocity="static", orders=3, compute=("areas",))
    found = computed(scene, 0.0, 6.03, 90.0)
    ring = 2 * math.pi * (1 - np.cos(np.radians([61.686934, 45.422610, 44.813239])))
    assert (np.abs(found["critical_area"] - ring) <= found["critical_area_error"] + 5e-8).all()
    assert (found["critical_area_error"] < 1e-6).all()
    # Every caustic is a point.
    assert (found["caustic_area"] <= found["caustic_area_error"]).all() and (found["caustic_area_error"] < 1e-15).all()


@pytest.mark.parametrize(
    "place", [(0.999, 6.03, 90.0), (0.9, 1.6, 90.0), pytest.param((0.9, 4.0, 11.5), marks=pytest.mark.slow)]
)
def test_error_of_areas_is_honest(place):
    """Against polygons of many more points, on splines of degree 7."""
    spin, radius, inclination = place
    found = computed(Scene(spin, radius, orders=2, compute=("areas",)), *place)
    camera = kc.Camera(spin, radius, math.radians(inclination))
    dark = kc.shadow_edge(camera, 2000)
    for i, caustic in enumerate(kc.caustics(camera, 2, tolerance=1e-10)):
        points = np.hstack([caustic.sky, caustic.celestial])
        points = np.vstack([points, points[:1]])
        arc = np.append(0, np.cumsum(np.linalg.norm(np.diff(points[:, :3], axis=0), axis=1)))
        dense = make_interp_spline(arc, points, k=7, bc_type="periodic")(np.linspace(0, arc[-1], 400 * len(arc)))
        area = abs(np.trapezoid(-np.cos(dense[:, 3]), dense[:, 4]))
        assert abs(found["caustic_area"][i] - area) <= found["caustic_area_error"][i] < 2e-6 * area
        solid = solid_angle(dense[:, :3] / np.linalg.norm(dense[:, :3], axis=1)[:, None])
        assert abs(found["critical_area"][i] - solid) <= found["critical_area_error"][i] < 1e-6 * solid
    # That of the shadow, which lies inside, was measured by another way in the test of the magnification.
    assert found["critical_area"][0] > found["critical_area"][1] > solid_angle(dark)


def solid_angle(curve):
    """Inside a closed curve of directions, from triangles about its middle."""
    following = np.roll(curve, -1, axis=0)
    middle = np.cross(curve, following).sum(axis=0)
    middle /= np.linalg.norm(middle)
    below = 1 + (curve * following).sum(axis=1) + curve @ middle + following @ middle
    return abs(2 * np.arctan2(np.cross(curve, following) @ middle, below).sum())


def test_error_of_the_magnification_is_honest():
    few, many = (
        computed(Scene(0.9, 6.0, compute=("magnification",), directions=n), 0.9, 6.0, 90.0) for n in (512, 16384)
    )
    dark = solid_angle(kc.shadow_edge(kc.Camera(0.9, 6.0), 2000)) / (4 * math.pi)
    for found in (few, many):
        assert abs(1 - found["escaping"] - dark) <= found["escaping_error"] + 1e-4
    doubt = few["magnification_error"] + many["magnification_error"]
    assert (np.abs(few["magnification"] - many["magnification"]) <= doubt).all()
    assert (doubt < 0.3 * many["magnification"]).all() and (np.diff(many["magnification"]) > 0).all()


def test_a_point_that_fails_costs_no_other(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path, "spin = [0.0, 0.9]\nradius = [1.6, 6.0]\norders = 1", "close.toml")
    status, out, err = run(capsys, "sweep", path)
    assert status == 1 and "4 points: 0 done before, 4 computed now, 1 failed; " in out
    where, end = err.splitlines()
    assert where.startswith("failed: spin 0, radius 1.6, inclination 90: Argument `radius` must be larger than the hor")
    assert end == "kerrcaustics: 1 of 4 points failed."
    store = opened(tmp_path / "close.zarr")
    assert store.status.values[:, :, 0].tolist() == [[2, 1], [1, 1]]
    assert np.isfinite(store.phi_extent.values[:, :, 0, 0]).tolist() == [[False, True], [True, True]]
    assert b"horizon" in bytes(store.reason.values[0, 0, 0])
    status, out, _ = run(capsys, "sweep", path)
    assert status == 1 and "4 points: 4 done before, 0 computed now, 1 failed; " in out


def test_long_lists_of_failures_are_cut(tmp_path, capsys, quick):
    path = written(tmp_path, "spin = 0.5\nradius = {from = 0.1, to = 2, count = 100}")
    status, _, err = run(capsys, "sweep", path, "--output", tmp_path / "s.zarr")
    lines = err.splitlines()
    assert status == 1 and len(lines) == 22 and lines[-2].startswith("... and 27 more; ")
    assert lines[-1] == "kerrcaustics: 47 of 100 points failed."
    assert len(quick) == 100
    run(capsys, "sweep", path, "--output", tmp_path / "s.zarr", "--retry")
    # Whole blocks of eight: six of them hold points that failed.
    assert len(quick) == 100 + 48


def test_an_interrupted_sweep_goes_on(tmp_path, scene, quick, monkeypatch):
    whole, part = tmp_path / "whole.zarr", tmp_path / "part.zarr"
    kc.sweep(scene, whole)
    assert len(quick) == 6
    quick.clear()

    kept = engine.computed

    def interrupt(*arguments):
        if len(quick) == 3:
            raise KeyboardInterrupt
        return kept(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(engine, "cores", lambda: 1)
        patch.setattr(engine, "computed", interrupt)
        with pytest.raises(KeyboardInterrupt):
            kc.sweep(scene, part)
    (part / "status" / "half.partial").write_bytes(b"half")
    before = len(quick)
    result = kc.sweep(scene, part)
    assert result.before <= before and len(quick) - before == 6 - result.before
    assert (result.points, result.failures) == (6, ()) and 0 < result.before < 6
    assert files(part) == files(whole)
    quick.clear()
    assert kc.sweep(scene, part).before == 6 and quick == []


HARM = {
    "flipped": lambda path: path.write_bytes(
        bytes([*path.read_bytes()[:-6], *(255 - b for b in path.read_bytes()[-6:])])
    ),
    "truncated": lambda path: path.write_bytes(path.read_bytes()[:-3]),
    "emptied": lambda path: path.write_bytes(b""),
    "lost": lambda path: path.unlink(),
}


@pytest.mark.parametrize("harm", HARM)
@pytest.mark.parametrize(
    "name", ["caustic_area/c/1/0/0/0", "caustic_area/c/1/1/0/0", "reason/c/1/1/0/0", "status/c/1/1/0"]
)
def test_a_harmed_chunk_is_computed_again(harm, name, tmp_path, scene, quick):
    path = tmp_path / "s.zarr"
    kc.sweep(scene, path)
    good = files(path)
    quick.clear()
    HARM[harm](path / name)
    assert files(path) != good
    radii = scene.values("radius")
    again = radii[2:] if "/c/1/1/" in name else radii[:2]
    assert kc.sweep(scene, path).before == 6 - len(again)
    assert sorted(quick) == [(0.9, radius, 90.0) for radius in again]
    assert files(path) == good


def test_a_store_of_another_scene_is_refused_with_a_diff(tmp_path, capsys, quick):
    target = tmp_path / "s.zarr"
    assert run(capsys, "sweep", written(tmp_path, PLAIN), "--output", target)[0] == 0
    good = files(target)
    other = written(tmp_path, PLAIN.replace("orders = 1", "orders = 2").replace("3.0, ", ""))
    status, out, err = run(capsys, "sweep", other, "--output", target)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert "another scene" in err
    assert "radius: [4.0, 6.0] here, [3.0, 4.0, 6.0] in the store; orders: 2 here, 1 in the store." in err
    renamed = written(tmp_path, PLAIN.replace("Schön", "Schöner"))
    assert run(capsys, "sweep", renamed, "--output", target)[0] == 0
    assert files(target) == good


def test_what_is_no_store_of_this_version_is_refused(tmp_path, scene, quick, capsys, monkeypatch):
    target, path = tmp_path / "s.zarr", written(tmp_path, PLAIN)
    kc.sweep(scene, target)
    good = files(target)
    monkeypatch.setattr("kerrcaustics.sweeps.store.version", lambda _: "9.9")
    status, out, err = run(capsys, "sweep", path, "--output", target)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert f"was written by kerrcaustics {kc.__version__}, and this is 9.9" in err
    monkeypatch.undo()
    (tmp_path / "folder").mkdir()
    for no_store in (path, tmp_path / "folder"):
        status, out, err = run(capsys, "sweep", path, "--output", no_store)
        assert (status, out) == (2, "") and err.count("\n") == 1 and "cannot be opened" in err
    zarr.open_group(str(tmp_path / "folder"), mode="w")
    status, out, err = run(capsys, "sweep", path, "--output", tmp_path / "folder")
    assert status == 2 and "holds no sweep" in err
    assert files(target) == good


def test_a_full_disk_at_any_moment(tmp_path, scene, quick, capsys, monkeypatch):
    """Also while the store is made: then there is none."""
    whole, path = tmp_path / "whole.zarr", written(tmp_path, PLAIN)
    kept, left = zarr.storage.LocalStore.set, [10**6]

    async def until_full(store, key, value):
        left[0] -= 1
        if left[0] < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        await kept(store, key, value)

    monkeypatch.setattr(zarr.storage.LocalStore, "set", until_full)
    kc.sweep(scene, whole)
    writes = 10**6 - left[0]
    for room in (3, 30, writes // 2, writes - 30, writes - 1):
        target = tmp_path / f"{room}.zarr"
        left[0] = room
        status, out, err = run(capsys, "sweep", path, "--output", target)
        assert (status, out) == (1, "") and err.count("\n") == 1
        assert "cannot be written: No space left on device. What it holds is kept" in err
        left[0] = 10**6
        result = kc.sweep(scene, target)
        assert (result.points, result.failures) == (6, ())
        assert result.before >= (4 if room == writes - 1 else 0)
        assert files(target) == files(whole)
    assert sorted(p.name for p in tmp_path.iterdir() if p.name.startswith(".")) == []


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="the superuser may write anywhere")
def test_a_read_only_store_is_one_line(tmp_path, scene, quick, capsys):
    target, path = tmp_path / "s.zarr", written(tmp_path, PLAIN)
    kc.sweep(scene, target)
    (target / "status" / "c" / "0" / "0" / "0").unlink()
    folders = [target, *(p for p in target.rglob("*") if p.is_dir())]
    for folder in folders:
        folder.chmod(0o500)
    try:
        status, out, err = run(capsys, "sweep", path, "--output", target)
    finally:
        for folder in folders:
            folder.chmod(0o700)
    assert (status, out) == (1, "") and err.count("\n") == 1 and "cannot be written: Permission denied." in err


def test_a_store_in_use_is_refused(tmp_path, scene, quick):
    kc.sweep(scene, tmp_path / "s.zarr")
    with Store(tmp_path / "s.zarr").locked(), pytest.raises(ValueError, match="another sweep is writing to it"):
        kc.sweep(scene, tmp_path / "s.zarr")
    assert kc.sweep(scene, tmp_path / "s.zarr").before == 6


def test_bad_arguments_are_one_line(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path, PLAIN)
    for arguments, words in (
        ((path, "--workers", 0), "Argument --workers must be 1 or more, but is 0."),
        ((path, "--workers", 2, "--scheduler", "tcp://127.0.0.1:1"), "only one of them can be given"),
        ((path, "--output", tmp_path / "no" / "s.zarr"), "in a folder that exists"),
        ((tmp_path / "none.toml",), "No such file"),
    ):
        status, out, err = run(capsys, "sweep", *arguments)
        assert (status, out) == (2, "") and err.count("\n") == 1 and words in err
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(ValueError, match="spin must be in"):
        kc.sweep(Scene(2.0, 3.0), tmp_path / "s.zarr")


@pytest.mark.parametrize("package", ["msgspec", "zarr", "distributed"])
def test_a_missing_package_is_named(package, tmp_path, capsys, monkeypatch):
    for name in [name for name in sys.modules if name.startswith("kerrcaustics.sweeps")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    status, out, err = run(capsys, "sweep", written(tmp_path, PLAIN), "--output", tmp_path / "s.zarr", "--workers", 1)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert package in err and 'pip install "kerrcaustics[sweep]"' in err


# Enough blocks that the ten moments at which something dies lie between the first and the last.
LONG = """
spin = {from = 0.5, to = 0.95, count = 12}
radius = [0.5, 3, 4, 5, 6, 7, 8, 9]
orders = 1
block = 1
compute = ["geometry", "cusps", "areas", "curves"]
"""


def started(path, target, *arguments):
    command = [sys.executable, "-m", "kerrcaustics", "sweep", path, "--output", target, *arguments]
    return subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def blocks_done(target):
    return len(list((Path(target) / "status" / "c").glob("*/*/*")))


def wait_for_more(process, target):
    before = blocks_done(target)
    while process.poll() is None and blocks_done(target) == before:
        time.sleep(0.01)


def check_finished(process):
    """The points inside the horizon failed, and no others."""
    out, _ = process.communicate(timeout=600)
    assert process.returncode == 1 and "kerrcaustics: 12 of 96 points failed." in out, out
    # Nothing that Dask says about itself.
    lines = out.splitlines()
    assert len(lines) == 15 and sum(line.startswith("failed: ") for line in lines) == 12, out


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    path = written(folder, LONG)
    check_finished(started(path, folder / "s.zarr"))
    return path, files(folder / "s.zarr")


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [(), ("--workers", 2)], ids=["threads", "workers"])
def test_killed_ten_times_the_sweep_ends_up_the_same(arguments, tmp_path, undisturbed):
    path, good = undisturbed
    target, chance = tmp_path / "s.zarr", random.Random(7)
    kills = 0
    while kills < 10:
        process = started(path, target, *arguments)
        if chance.random() < 0.8:
            wait_for_more(process, target)
            time.sleep(chance.uniform(0, 0.3))
        else:
            time.sleep(chance.uniform(0, 5))
        assert process.poll() is None, process.communicate()
        process.kill()
        process.communicate()
        kills += 1
    assert blocks_done(target) < 96
    # Workers notice that they are alone.
    if arguments:
        time.sleep(2)
    check_finished(started(path, target, *arguments))
    assert files(target) == good


@pytest.mark.slow
def test_workers_that_are_killed_change_nothing(tmp_path, undisturbed):
    path, good = undisturbed
    target, chance = tmp_path / "s.zarr", random.Random(8)
    process = started(path, target, "--workers", 2)
    kills = 0
    while kills < 10:
        wait_for_more(process, target)
        time.sleep(chance.uniform(0, 0.3))
        children = psutil.Process(process.pid).children(recursive=True)
        workers = [child for child in children if "spawn_main" in " ".join(child.cmdline())]
        if workers:
            chance.choice(workers).send_signal(signal.SIGKILL)
            kills += 1
    assert blocks_done(target) < 96
    check_finished(process)
    assert files(target) == good


@pytest.mark.slow
def test_a_dask_cluster_of_other_processes_gives_the_same_store(tmp_path, undisturbed):
    path, good = undisturbed
    told = tmp_path / "scheduler.json"
    options = ("--scheduler-file", told, "--no-dashboard")
    commands = [("dask_scheduler", *options, "--host", "127.0.0.1", "--port", 0)]
    commands += [("dask_worker", *options, "--nthreads", 1)] * 2
    helpers = []
    try:
        for name, *rest in commands:
            command = [sys.executable, "-m", f"distributed.cli.{name}", *map(str, rest)]
            helpers.append(
                subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            )
        while not told.exists() or not told.read_text().strip():
            time.sleep(0.1)
        address = json.loads(told.read_text())["address"]
        check_finished(started(path, tmp_path / "s.zarr", "--scheduler", address))
    finally:
        for helper in helpers:
            helper.terminate()
        for helper in helpers:
            helper.wait(timeout=60)
    assert files(tmp_path / "s.zarr") == good


@pytest.mark.slow
def test_no_scheduler_is_one_line(tmp_path, capsys):
    path = written(tmp_path, PLAIN)
    arguments = ("--output", tmp_path / "s.zarr", "--scheduler", "tcp://127.0.0.1:9")
    status, out, err = run(capsys, "sweep", path, *arguments)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert (
        "Argument --scheduler must be the address of a Dask scheduler, but 'tcp://127.0.0.1:9' does not answer" in err
    )


@pytest.mark.slow
def test_a_full_disk_on_a_worker_is_one_line(tmp_path, capsys):
    """A file where a folder must be stands for it: the superuser of a container meets it too."""
    path, target = written(tmp_path, PLAIN), tmp_path / "s.zarr"
    assert run(capsys, "sweep", path, "--output", target)[0] == 0
    (target / "status" / "c" / "1" / "1" / "0").unlink()
    (target / "status" / "c" / "1" / "1").rmdir()
    (target / "status" / "c" / "1" / "1").write_text("")
    status, out, err = run(capsys, "sweep", path, "--output", target, "--workers", 1)
    assert (status, out) == (1, "") and err.count("\n") == 1 and "cannot be written: " in err
