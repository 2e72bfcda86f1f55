"""Scenes, and stores that survive what can happen to them."""

import errno
import json
import os
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import zarr
from command_line import run
from marks import few
from offenders import for_each
from sweeping import PLAIN, files, made_up, opened, written

import kerrcaustics as kc
from kerrcaustics.sweeps import run as engine
from kerrcaustics.sweeps.opened import open_sweep, sweep_status
from kerrcaustics.sweeps.scene import Range, Scene
from kerrcaustics.sweeps.store import store_at


@pytest.fixture
def scene(tmp_path):
    return kc.read_scene(written(tmp_path, PLAIN))


@pytest.fixture
def quick(monkeypatch):
    """Numbers that cost nothing, in place of the physics; the list of points that were computed."""
    calls = []

    def numbers(scene, spin, radius, inclination):
        calls.append((spin, radius, inclination))
        return made_up(scene, spin, radius, inclination)

    monkeypatch.setattr(engine, "computed", numbers)
    return calls


def test_the_page_lists_all_keys_and_variables(monkeypatch):
    docs = Path(__file__).parents[1] / "docs"
    monkeypatch.syspath_prepend(docs)
    from kerrcaustics.scene_files.key_tables import described
    from kerrcaustics.sweeps.key_tables import scene_table, variable_table

    assert list(described(Scene)) == list(Scene.__struct_fields__)
    assert all(f"| `{key}` |" in scene_table() for key in Scene.__struct_fields__)
    rows = variable_table().splitlines()[2:]
    assert len(rows) == 23 and all(
        f"| `{name}` |" in "".join(rows) for name in ("phi_extent", "cusp_error", "escaping")
    )
    page = (docs / "sweeps.md").read_text(encoding="utf-8")
    assert "<!-- keys -->" in page and "<!-- variables -->" in page


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
        3,
        "all",
    )
    assert scene == expected
    least = kc.read_scene(written(tmp_path, "spin = 0.5\nradius = 6"))
    assert least.shape == (1, 1, 1) and least.values("inclination").tolist() == [90]


BAD = {
    "spin = {from = 0, to = 1, count = 'x'}\nradius = 3": "spin.count must be a whole number, but is 'x'.",
    "spin = {from = 0, count = 2}\nradius = 3": "spin: missing key `to`",
    "spin = {from = 0, to = 0.5, count = 2, by = 1}\nradius = 3": "spin: unknown key `by`",
    "spin = {from = 0, to = 0.5, count = 2, spacing = 'even'}\nradius = 3": "spin.spacing must be linear or log, "
    "but is 'even'.",
    "spin = 'fast'\nradius = 3": "spin must be a number, a list or a table, but is 'fast'.",
    "spin = [0.1, 'fast']\nradius = 3": "spin[1] must be a number, but is 'fast'.",
    "spin = 0.5": "missing key `radius`",
    "spin = 0.5\nradius = 3\ncolour = 1": "unknown key `colour`",
    "spin = 0.5\nradius = 3\norders = 2.5": "orders must be a whole number, but is 2.5.",
    "spin = 0.5\nradius = 3\norders = 0": "orders must be from 1 to 10, but is 0",
    "spin = 0.5\nradius = 3\norders = 8\ncompute = ['counts']": "orders must be 7 at most where counts are computed",
    "spin = 0.5\nradius = 3\ncompute = ['mass']": "compute[0] must be geometry, cusps, areas",
    "spin = 0.5\nradius = 3\ncompute = []": "compute must be a list of different quantities",
    "spin = 0.5\nradius = 3\ncompute = ['areas', 'areas']": "compute must be a list of different quantities",
    "spin = 0.5\nradius = 3\nvelocity = 'warp'": "velocity must be circular, fiducial or static, but is 'warp'.",
    "spin = 0.5\nradius = 3\nblock = 0": "block must be from 1 to 10000, but is 0",
    "spin = [0.5, 1.0]\nradius = 3": "spin must be in [0, 1), but is 1.0",
    "spin = 0.5\nradius = -3": "radius must be more than 0 and finite, but is -3.0",
    "spin = 0.5\nradius = inf": "radius must be more than 0 and finite, but is inf",
    "spin = []\nradius = 3": "spin must be a list of one value or more, but is []",
    "spin = 0.5\nradius = [3, 3]": "radius must be values that differ",
    "spin = 0.5\nradius = 3\ninclination = 200": "inclination must be in [0, 180] degrees, but is 200.0",
    "spin = {from = 0, to = 0.5, count = 0}\nradius = 3": "spin.count must be from 1 to",
    "spin = {from = 0.5, to = 0.1, count = 3}\nradius = 3": "spin must be values that differ, from the least to "
    "the largest, but is {from = 0.5, to = 0.1, count = 3}.",
    "spin = 0.5\nradius = {from = 0, to = 9, count = 3, spacing = 'log'}": "radius.from and radius.to must be "
    'more than 0 for log spacing, but is {from = 0, to = 9, count = 3, spacing = "log"}.',
    "spin = {from = 0, to = 0.9, count = 3000}\nradius = {from = 2, to = 9, count = 3000}": "the number of points",
    "spin = 0.5 radius = 3": "line 1",
}


@for_each(text=BAD)
def test_bad_scene_is_one_line_that_names_the_place(text, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path, text)
    status, out, err = run(capsys, "sweep", path)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert err.startswith(f"kerrcaustics: Sweep file {path}: ") and BAD[text] in err
    assert list(tmp_path.iterdir()) == [path]


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
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        reasons = open_sweep(tmp_path / "close.zarr").reason
    assert "horizon" in reasons.values[0, 0, 0] and reasons.values[1].tolist() == [[""], [""]]
    assert reasons.dims == ("spin", "radius", "inclination")
    status, out, _ = run(capsys, "sweep", path)
    assert status == 1 and "4 points: 4 done before, 0 computed now, 1 failed; " in out
    assert run(capsys, "sweep", path, "--resume")[1].split(";")[0] == out.split(";")[0]
    status, out, err = run(capsys, "sweep", path, "--no-resume")
    assert (status, out) == (2, "") and err.startswith("kerrcaustics: Argument --output must name a new store")


def test_the_status_of_a_sweep_is_reported_and_nothing_changed(tmp_path, scene, quick, capsys, monkeypatch):
    store = tmp_path / "s.zarr"

    def stop_at_last(scene, spin, radius, inclination):
        if (spin, radius) == (0.9, 6.0):
            raise KeyboardInterrupt
        return made_up(scene, spin, 0.5 if radius == 4 else radius, inclination)

    monkeypatch.setattr(engine, "computed", stop_at_last)
    with pytest.raises(KeyboardInterrupt):
        kc.sweep(scene, store)
    before = files(store)
    status, out, err = run(capsys, "sweep", "--status", store)
    found = sweep_status(store)
    assert (found.points, found.done + found.failed + found.missing) == (6, 6) and found.missing and not found.running
    counts = f"{found.done} done, {found.failed} failed, {found.missing} not computed yet"
    assert status == 0 and out == f"{store}: 6 points: {counts}\n"
    assert err.splitlines() == [f"failed: {line}" for line in found.failures] and "radius 4" in err
    status, out, _ = run(capsys, "sweep", "--status", store, "--json", "-")
    assert status == 0 and json.loads(out)["schema"] == "kerrcaustics/sweep-status/1"
    with store_at(store, scene):
        assert "; a sweep is writing to it now" in run(capsys, "sweep", "--status", store)[1]
    assert files(store) == before
    for arguments, words in (
        ((tmp_path,), "--status must name the store of a sweep, but"),
        ((store, "--output", "x"), "Argument --output must not be used with --status."),
        ((store, "x.toml"), "Argument FILE must not be used with --status."),
    ):
        status, out, err = run(capsys, "sweep", "--status", *arguments)
        assert (status, out) == (2, "") and err.count("\n") == 1 and words in err


@pytest.mark.slow
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
    "name",
    few(
        ("caustic_area/c/1/1/0/0", "reason/c/1/1/0/0", "caustic_area/c/1/0/0/0", "status/c/1/1/0"),
        ("caustic_area/c/1/0/0/0",),
    ),
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
    result = kc.sweep(scene, path)
    # A status that is not there may never have been.
    assert (result.before, result.damaged) == (
        6 - len(again),
        0 if (harm, name[:6]) == ("lost", "status") else len(again),
    )
    assert sorted(quick) == [(0.9, radius, 90.0) for radius in again]
    assert files(path) == good


def test_a_store_of_another_scene_is_refused_with_a_diff(tmp_path, capsys, quick):
    target = tmp_path / "s.zarr"
    assert run(capsys, "sweep", written(tmp_path, PLAIN), "--output", target)[0] == 0
    good = files(target)
    other = written(tmp_path, PLAIN.replace("orders = 1", "orders = 2").replace("3.0, ", ""))
    status, out, err = run(capsys, "sweep", other, "--output", target)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert "another sweep" in err
    assert "radius: [4.0, 6.0] here, [3.0, 4.0, 6.0] in the store; orders: 2 here, 1 in the store." in err
    renamed = written(tmp_path, PLAIN.replace("Schön", "Schöner"))
    assert run(capsys, "sweep", renamed, "--output", target)[0] == 0
    assert files(target) == good


def test_what_is_no_store_of_this_version_is_refused(tmp_path, scene, quick, capsys, monkeypatch):
    target, path = tmp_path / "s.zarr", written(tmp_path, PLAIN)
    kc.sweep(scene, target)
    good = files(target)
    monkeypatch.setattr("kerrcaustics.sweeps.descriptions.version", lambda _: "9.9")
    status, out, err = run(capsys, "sweep", path, "--output", target)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert f"was written by kerrcaustics {kc.__version__}, and this is 9.9" in err
    monkeypatch.undo()
    (tmp_path / "folder").mkdir()
    for no_store, words in (
        (path, "name a store, which is a folder"),
        (tmp_path / "folder", "name the store of a sweep"),
    ):
        status, out, err = run(capsys, "sweep", path, "--output", no_store)
        assert (status, out) == (2, "") and err.count("\n") == 1
        assert f"Argument --output must {words}" in err and no_store.name in err
    zarr.open_group(str(tmp_path / "folder"), mode="w")
    status, out, err = run(capsys, "sweep", path, "--output", tmp_path / "folder")
    assert status == 2 and "holds no sweep" in err
    assert files(target) == good


def test_damage_is_reported(tmp_path, quick, capsys):
    path, target = written(tmp_path, PLAIN), tmp_path / "s.zarr"
    assert "damaged" not in run(capsys, "sweep", path, "--output", target)[1]
    HARM["emptied"](target / "status" / "c" / "1" / "1" / "0")
    assert (
        "\n1 points were damaged in the store, and have been computed again\n"
        in run(capsys, "sweep", path, "--output", target)[1]
    )
    assert "damaged" not in run(capsys, "sweep", path, "--output", target)[1]


@pytest.mark.slow
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
        end = "What it holds is kept; start again to resume." if target.exists() else "None of it is left."
        assert f"cannot be written: No space left on device. {end}" in err
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
    with store_at(tmp_path / "s.zarr", scene), pytest.raises(ValueError, match="another sweep is writing to it"):
        kc.sweep(scene, tmp_path / "s.zarr")
    assert kc.sweep(scene, tmp_path / "s.zarr").before == 6


def test_bad_arguments_are_one_line(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path, PLAIN)
    for arguments, words in (
        ((path, "--workers", 0), "Argument --workers must be 1 or more, but is 0."),
        ((path, "--workers", 2, "--scheduler", "tcp://127.0.0.1:1"), "only one of them can be given"),
        ((path, "--output", tmp_path / "no" / "s.zarr"), "in a folder that exists"),
        ((path, "--output", "/proc/s.zarr"), "Argument --output must name a store that can be written: /proc/s.zarr"),
        ((path, "--output", path), "Argument --output must name a store, which is a folder, but"),
        ((path, "--output", path / "s.zarr"), "in a folder that exists"),
        ((path, "--output", ""), "Argument --output must be a name, but is empty."),
        ((path, "--scheduler", "nonsense"), "--scheduler must be the address of a Dask scheduler, such as"),
        ((path, "--scheduler", "tcp://127.0.0.1:99999"), "--scheduler must be the address of a Dask scheduler, such"),
        ((tmp_path / "none.toml",), "No such file"),
        (("",), "Argument FILE must be a name, but is empty."),
    ):
        status, out, err = run(capsys, "sweep", *arguments)
        assert (status, out) == (2, "") and err.count("\n") == 1 and words in err
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(ValueError, match="Argument `scene` must be"):
        kc.sweep("scene.toml", tmp_path / "none.zarr")
    with pytest.raises(ValueError, match="spin must be in"):
        kc.sweep(Scene(2.0, 3.0), tmp_path / "s.zarr")


@pytest.mark.parametrize("package", ["zarr", "distributed"])
def test_a_missing_package_is_named(package, tmp_path, capsys, monkeypatch):
    for name in [name for name in sys.modules if name.startswith("kerrcaustics.sweeps")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    arguments = ("--output", tmp_path / "s.zarr", "--scheduler", "tcp://127.0.0.1:1")
    status, out, err = run(capsys, "sweep", written(tmp_path, PLAIN), *arguments)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert package in err and "pip install '.[sweep]'" in err


def test_keys_are_printed_alone(capsys):
    from command_line import run

    status, out, err = run(capsys, "sweep", "--keys")
    assert (status, err) == (0, "") and "| `orders` |" in out and "| `geometry` |" in out
    for more in (["x.toml"], ["--status", "x.zarr"], ["--retry"], ["--workers", "2"], ["--json", "-"]):
        status, out, err = run(capsys, "sweep", "--keys", *more)
        assert (status, out) == (2, "") and "must not be used with --keys" in err, more
    status, out, err = run(capsys, "scene", "--keys")
    assert (status, err) == (0, "") and "**`[hole]`**" in out and "| `spin`" in out
    status, _, err = run(capsys, "scene", "--keys", "--template", "disk")
    assert status == 2 and "--keys must be used alone" in err
