"""Stores of sweeps that are damaged, file by file, and stores that several sweeps begin at once."""

import random
import shutil
import threading
from multiprocessing import get_context

import numpy as np
import pytest
import zarr
from command_line import run
from harming import HARM, hold_a_folder, restored
from marks import few
from sweeping import PLAIN, files, made_up, opened, sweep_in_step, written

import kerrcaustics as kc
from kerrcaustics.sweeps import run as engine


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Numbers that cost nothing, in place of the physics."""
    monkeypatch.setattr(engine, "computed", made_up)


@pytest.fixture
def scene(tmp_path):
    return kc.read_scene(written(tmp_path, PLAIN))


@pytest.fixture
def good(tmp_path, scene):
    """A store that nobody disturbs."""
    path = tmp_path / "good.zarr"
    kc.sweep(scene, path)
    return path


@pytest.mark.parametrize("harm", few(HARM, ("truncated", "lost", "a folder")))
def test_what_is_damaged_is_mended(harm, tmp_path, scene, good):
    """A description and an axis, the root among them, and a chunk that was done."""
    path, chance = restored(good, tmp_path / "s.zarr"), random.Random(1)
    harmed = ("zarr.json", "radius/zarr.json", "spin/c/0", "order/c/0", "caustic_area/zarr.json")
    for name in (*harmed, "caustic_area/c/1/0/0/0"):
        HARM[harm](path / name, chance)
    result = kc.sweep(scene, path)
    assert sorted(result.mended) == sorted(harmed)
    assert (result.before, result.damaged) == (4, 2)
    assert files(path) == files(good)
    assert kc.sweep(scene, path).mended == ()


@pytest.mark.parametrize("name", ["caustic_area", "digest"])
def test_a_sound_chunk_of_another_place_or_scene_is_computed_again(name, tmp_path, scene, good):
    other = kc.read_scene(written(tmp_path, PLAIN.replace("[0.5, 0.9]", "[0.5, 0.8]"), "other.toml"))
    kc.sweep(other, tmp_path / "other.zarr")
    for source in (good / name / "c/0/0/0", tmp_path / "other.zarr" / name / "c/1/0/0"):
        path = restored(good, tmp_path / "s.zarr")
        suffix = "/0" if (path / name / "c/1/0/0").is_dir() else ""
        shutil.copy(f"{source}{suffix}", f"{path / name / 'c/1/0/0'}{suffix}")
        result = kc.sweep(scene, path)
        assert result.damaged == 2 and files(path) == files(good)


def test_chunks_of_a_whole_block_of_another_place_are_computed_again(tmp_path, scene, good):
    path = restored(good, tmp_path / "s.zarr")
    for block in path.glob("*/c/1/0"):
        shutil.rmtree(block)
        shutil.copytree(block.parents[1] / "0" / "0", block)
    assert kc.sweep(scene, path).damaged == 2
    assert files(path) == files(good)


@pytest.mark.parametrize("workers", [None, pytest.param(1, marks=pytest.mark.slow)])
def test_a_store_that_is_moved_while_a_sweep_runs_is_named_so(workers, tmp_path):
    """Nothing is left in its place, and the sweep goes on where the store is."""
    path, elsewhere = tmp_path / "s.zarr", tmp_path / "elsewhere.zarr"
    points = kc.read_scene(written(tmp_path, PLAIN.replace("[0.5, 0.9]", "[0.5, 0.6, 0.7, 0.8, 0.9]"), "long.toml"))

    def moves(_what, part):
        if part > 0.2 and path.exists():
            path.rename(elsewhere)

    with pytest.raises(ValueError, match=r"^The store .+ was moved or removed while the sweep was running\. Start"):
        kc.sweep(points, path, workers=workers, progress=moves)
    assert not path.exists()
    result = kc.sweep(points, elsewhere)
    assert 0 < result.before < 15 and not result.damaged


@pytest.mark.slow
@pytest.mark.parametrize("harm", HARM)
def test_every_file_may_be_damaged(harm, tmp_path, scene, good):
    """Damages one after the other; of flipped bits and cuts, three in each file."""
    path, whole, chance = tmp_path / "s.zarr", files(good), random.Random(2)
    for name in sorted(whole):
        for _ in range(3 if harm in ("flipped", "truncated") else 1):
            restored(good, path)
            HARM[harm](path / name, chance)
            result = kc.sweep(scene, path)
            assert files(path) == whole, name
            assert (result.mended == (name,)) == ("/c/" not in name or name.count("/") == 2), name


def test_damage_of_a_description_is_reported(tmp_path, good, capsys):
    (good / "spin" / "c" / "0").unlink()
    reported = "\n1 files that describe the store were lost or altered, and have been rewritten\n"
    arguments = ("sweep", tmp_path / "scene.toml", "--output", good)
    assert reported in run(capsys, *arguments)[1]
    assert "have been rewritten" not in run(capsys, *arguments)[1]


@pytest.mark.parametrize("name", ["zarr.json", "spin/c/0", "caustic_area/c/1/0/0/0", "status/c/0/0/0"])
def test_a_folder_with_something_in_it_is_one_line_that_names_it(name, tmp_path, good, capsys):
    hold_a_folder(good / name)
    status, out, err = run(capsys, "sweep", tmp_path / "scene.toml", "--output", good)
    assert (status, out) == (1, "") and err.count("\n") == 1
    assert f"cannot be written: a folder is in the place of the file {good / name}." in err
    assert (good / name / "notes.txt").read_text() == "mine"


def test_a_store_whose_scene_nobody_can_say_is_one_line(tmp_path, scene, good, capsys):
    """Root and mask are damaged both; and a root that is damaged where the store is of another sweep."""
    arguments = ("--output", good)
    (good / "zarr.json").write_text("{")
    other = written(tmp_path, PLAIN.replace("orders = 1", "orders = 2"), "other.toml")
    whole = files(good)
    for path in (other, tmp_path / "scene.toml"):
        status, out, err = run(capsys, "sweep", path, *arguments)
        assert (status, out) == (2, "") and err.count("\n") == 1
        assert f"The store {good} is damaged: {good / 'zarr.json'} is lost or altered" in err
        assert files(good) == whole
        (good / "status" / "zarr.json").write_text('{"attributes": {"mark": "x"}}')
        whole = files(good)


def test_a_title_that_is_altered_is_that_of_the_scene_again(tmp_path, scene, good):
    whole, root = files(good), good / "zarr.json"
    root.write_text(root.read_text().replace("Sch", "Scx"))
    assert kc.sweep(scene, good).mended == ("zarr.json",)
    assert files(good) == whole


@pytest.mark.parametrize("harm", ["lost", "emptied", "truncated", "flipped"])
def test_readers_see_no_wrong_place_where_an_axis_is_damaged(harm, scene, good):
    """Blanks where it is lost, else an error: never another number."""
    for name in ("spin", "radius", "order"):
        HARM[harm](good / name / "c" / "0", random.Random(3))
        try:
            values = np.asarray(zarr.open_group(str(good), mode="r")[name])
        except Exception as error:
            assert "checksum" in str(error).lower() or harm != "flipped"
            continue
        assert harm == "lost" and (np.isnan(values) if values.dtype.kind == "f" else values == -1).all()


def test_a_lost_axis_is_not_zero_in_xarray(good):
    (good / "spin" / "c" / "0").unlink()
    assert np.isnan(opened(good).spin.values).all()


def started_at_once(sweeps):
    """The outcome of each of two sweeps that begin at one moment: its result, or the error."""
    gate, done = threading.Barrier(2), [None, None]

    def one(i):
        gate.wait()
        try:
            done[i] = kc.sweep(*sweeps)
        except ValueError as error:
            done[i] = error

    threads = [threading.Thread(target=one, args=(i,)) for i in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return done


@pytest.mark.slow
def test_of_two_sweeps_that_begin_a_store_at_once_none_destroys_it(tmp_path, scene, good):
    for i in range(5):
        path = tmp_path / f"{i}.zarr"
        for result in started_at_once((scene, path)):
            refused = isinstance(result, ValueError) and "another sweep is writing to it" in str(result)
            assert refused or (result.points, result.failures) == (6, ()), result
        assert files(path) == files(good)
    assert not list(tmp_path.glob(".*"))


@pytest.mark.slow
def test_thirty_pairs_of_processes_begin_a_store_at_once(tmp_path, good):
    context = get_context("spawn")
    gate, answers = context.Barrier(2), context.Queue()
    pair = [
        context.Process(target=sweep_in_step, args=(tmp_path / "scene.toml", tmp_path, 30, gate, answers))
        for _ in range(2)
    ]
    for process in pair:
        process.start()
    reported = sorted(answers.get(timeout=600) for _ in range(60))
    for process in pair:
        process.join()
    for i in range(30):
        ways = [way for number, way in reported if number == i]
        assert ways in (["done", "done"], ["done", "in use"]), ways
        assert files(tmp_path / f"{i}.zarr") == files(good)
    assert not list(tmp_path.glob(".*"))
