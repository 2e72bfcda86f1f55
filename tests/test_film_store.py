"""Frames that are kept until a film is complete, and what can happen to them."""

import errno
import json
import os
import random
import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import av
import numpy as np
import pytest
from command_line import run
from filming import MovingBar, read_bar
from PIL import Image

from kerrcaustics.cli import terminal
from kerrcaustics.films.film import Film, frames_folder, make_film
from kerrcaustics.films.frame_store import write_frame
from kerrcaustics.films.scene_films import scene_film
from kerrcaustics.films.video import write_pictures
from kerrcaustics.scene_files import templates

GOOD = MovingBar()


@pytest.fixture
def path(tmp_path):
    return tmp_path / "bar.mp4"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The bytes of the film that nobody disturbs."""
    path = tmp_path_factory.mktemp("whole") / "whole.mp4"
    make_film(path, scene_film(GOOD))
    return path.read_bytes()


def interrupted(path, at, error=KeyboardInterrupt):
    """Draw the frames before one, in which something happens."""

    def draw(number):
        if number == at:
            raise error
        return GOOD.picture(number)

    with pytest.raises(error):
        make_film(path, replace(scene_film(GOOD), draw=draw))


def gone_on(path, scene=GOOD, **options):
    """The result of a film that is started again, and the frames that it draws."""
    fresh = replace(scene, drawn=[])
    return make_film(path, scene_film(fresh), **options), fresh.drawn


def frame(path, number):
    return frames_folder(path) / f"{number:06d}.png"


def test_a_film_goes_on_and_ends_up_the_same(path, whole):
    interrupted(path, 7)
    assert [file.name for file in path.parent.iterdir()] == [f".{path.name}.frames"]
    for half in (frames_folder(path) / ".000007.png.x.part", path.parent / f".{path.name}.x.part"):
        half.write_bytes(b"half")
    reported = []
    result, drawn = gone_on(path, progress=lambda *what: reported.append(what))
    assert drawn == list(range(7, 12)) and path.read_bytes() == whole
    assert (result.frames, result.reused, result.drawn, result.failed, result.output) == (12, 7, 5, 0, path)
    # What was there before comes first, in one step: else nobody can estimate the time left.
    assert reported[0] == ("7 of 12 frames", 7 / 12) and reported[-1] == ("done", 1.0)
    assert list(path.parent.iterdir()) == [path]


def flipped(file):
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)


HARM = {
    "flipped": flipped,
    "truncated": lambda file: file.write_bytes(file.read_bytes()[:-5]),
    "halved": lambda file: file.write_bytes(file.read_bytes()[: file.stat().st_size // 2]),
    "emptied": lambda file: file.write_bytes(b""),
    "lost": lambda file: file.unlink(),
    "of another number": lambda file: shutil.copy(file.with_name("000002.png"), file),
    "of another program": lambda file: write_frame(file, GOOD.picture(4)),
    "no picture": lambda file: file.write_text("hello"),
}


@pytest.mark.parametrize("harm", HARM)
def test_a_harmed_frame_is_drawn_again(harm, path, whole):
    interrupted(path, 7)
    HARM[harm](frame(path, 4))
    result, drawn = gone_on(path)
    assert drawn == [4, *range(7, 12)] and result.reused == 6
    assert path.read_bytes() == whole


def test_a_frame_that_is_harmed_while_the_film_is_written_is_reported(path, monkeypatch):
    interrupted(path, 11)

    def written(_path, pictures, _rate):
        frame(path, 3).write_bytes(b"")
        return list(pictures)

    monkeypatch.setattr("kerrcaustics.films.film.write_pictures", written)
    with pytest.raises(RuntimeError, match="Frame 3 was lost while the film was written; start again"):
        gone_on(path)


def test_a_frame_that_fails_costs_no_other(path, whole):
    result, drawn = gone_on(path, replace(GOOD, fails=(3, 5)))
    assert drawn == list(range(12)) and result.output is None and not path.exists()
    assert (result.drawn, result.reused, result.failed) == (10, 0, 2)
    assert result.failures[0] == "frame 3: RuntimeError: the sky is falling on 3"
    reported = (
        "2 of 12 frames failed: frame 3: RuntimeError: the sky is falling on 3. So did frame 5. The other 10 are kept"
    )
    assert result.complaint.startswith(reported)
    result, drawn = gone_on(path)
    assert drawn == [3, 5] and result.reused == 10 and path.read_bytes() == whole


def test_frames_of_a_changed_scene_are_kept_and_what_differs_is_reported(path, whole):
    interrupted(path, 7)
    kept = {file.name: file.read_bytes() for file in frames_folder(path).iterdir()}
    for scene, quality, reported in (
        (replace(GOOD, speed=5), None, "scene.speed: 5 here, 6 there"),
        (GOOD, "draft", 'quality: "draft" here, "normal" there'),
        (replace(GOOD, frames=9, size=(2, 4)), None, "scene.frames: 9 here, 12 there; scene.size[0]: 2 here, 96 th"),
    ):
        with pytest.raises(ValueError, match="of another film") as error:
            make_film(path, scene_film(scene, quality))
        assert reported in str(error.value) and "--restart" in str(error.value) and str(error.value).count("\n") == 0
    (frames_folder(path) / "film.json").write_text("[")
    with pytest.raises(ValueError, match=r"film.json cannot be read"):
        gone_on(path, replace(GOOD, speed=5))
    (frames_folder(path) / "film.json").write_bytes(kept["film.json"])
    assert {file.name: file.read_bytes() for file in frames_folder(path).iterdir()} == kept
    result, drawn = gone_on(path, replace(GOOD, speed=5), restart=True)
    assert drawn == list(range(12)) and result.output == path and path.read_bytes() != whole


def test_another_version_draws_into_another_store(path, monkeypatch):
    interrupted(path, 7)
    monkeypatch.setattr("kerrcaustics.films.frame_store.metadata", SimpleNamespace(version=lambda _: "9.9"))
    with pytest.raises(ValueError, match=r'version: "9.9" here, "[\d.]+" there'):
        gone_on(path)


def test_a_clip_shares_its_frames_with_the_film(path, whole):
    frames_folder(path).mkdir()
    (frames_folder(path) / ".000004.png.x.part").write_bytes(b"half")
    result, drawn = gone_on(path, frames=range(4, 7))
    assert sorted(file.name for file in frames_folder(path).iterdir())[0] == "000004.png"
    assert drawn == [4, 5, 6] and (result.frames, result.drawn) == (3, 3) and path.read_bytes() != whole
    result, drawn = gone_on(path)
    assert drawn == [0, 1, 2, 3, *range(7, 12)] and path.read_bytes() == whole
    for clip in (range(4, 13), range(0)):
        with pytest.raises(ValueError, match="Argument `frames` must lie within 0:12"):
            gone_on(path, frames=clip)


def test_one_film_at_a_time(path):
    def draw(_number):
        gone_on(path)

    result = make_film(path, replace(scene_film(GOOD), draw=draw))
    assert "is drawing them" in result.failures[0] and "frames failed" in result.complaint


def test_bad_places_are_refused(path):
    for options, reported in (
        ({"workers": 0}, "Argument `workers` must be 1 or more"),
        ({"workers": 2, "scheduler": "tcp://x:1"}, "only one of them"),
    ):
        with pytest.raises(ValueError, match=reported):
            gone_on(path, **options)
    assert list(path.parent.iterdir()) == []


@pytest.mark.slow
def test_the_encoder_asks_neither_for_cores_nor_for_what_lay_in_memory(tmp_path, whole):
    """As x264 says itself in every file; and with its macroblock tree one in ten of these films differs."""
    assert b"threads=1 " in whole and b"mbtree=0 " in whole
    pictures, chance, junk = [GOOD.picture(number) for number in range(GOOD.frames)], random.Random(3), []
    for _ in range(30):
        junk = [chance.randbytes(1) * chance.randrange(100, 300_000) for _ in range(20)] + junk[::2]
        write_pictures(tmp_path / "again.mp4", iter(pictures), GOOD.rate)
        assert (tmp_path / "again.mp4").read_bytes() == whole


@pytest.fixture
def scenes(monkeypatch, tmp_path):
    """Scene files that are bars: a function that writes one."""
    reading = SimpleNamespace(read_scene=read_bar)
    monkeypatch.setitem(sys.modules, "kerrcaustics.scene_files", SimpleNamespace(reading=reading))
    monkeypatch.setitem(sys.modules, "kerrcaustics.sweeps.reading", reading)
    monkeypatch.setitem(sys.modules, "kerrcaustics.scene_files.templates", templates)

    def write(text="{}"):
        file = tmp_path / "bar.toml"
        file.write_text(text)
        return file

    return write


def test_command_makes_the_film_of_a_scene(path, whole, scenes, capsys, monkeypatch):
    monkeypatch.chdir(path.parent)
    status, out, err = run(capsys, "film", scenes())
    assert (status, err) == (0, "") and "12 frames: 0 drawn before, 12 now" in out and "Film: bar.mp4" in out
    assert re.search(r"^frames \d+\.\d s, encoding \d+\.\d s$", out, re.MULTILINE)
    assert path.read_bytes() == whole
    status, out, err = run(capsys, "film", scenes(), "--frames", "2:6", "--quality", "draft", "--json", "-")
    assert status == 0 and "Its frames are kept" in err
    found = json.loads(out)
    assert found.pop("seconds") > 0 and found.pop("stages").keys() == {"frames", "encoding"}
    assert found == {
        "schema": "kerrcaustics/film/1",
        "frames": 4,
        "drawn": 4,
        "reused": 0,
        "failed": 0,
        "failures": [],
        "output": "bar.mp4",
    }


@pytest.mark.parametrize(("option", "value", "size"), [("--size", "64x50", (64, 50)), ("--scale", "0.35", (34, 16))])
def test_a_film_in_another_size(option, value, size, path, scenes, capsys):
    status, _, _ = run(capsys, "film", scenes(), "--output", path, option, value)
    assert status == 0
    with av.open(str(path)) as film:
        assert (film.streams.video[0].width, film.streams.video[0].height) == size


def test_command_says_what_failed_and_goes_on(path, whole, scenes, capsys):
    target = path.with_suffix(".json")
    arguments = ("film", scenes('{"fails": [3]}'), "--output", path, "--json", target)
    status, out, err = run(capsys, *arguments)
    assert (status, out) == (1, "") and err.count("\n") == 1
    assert "1 of 12 frames failed: frame 3: RuntimeError: the sky is falling on 3. The other 11 are kept in" in err
    assert '"failed": 1' in target.read_text() and '"output": null' in target.read_text()
    scenes()
    status, out, err = run(capsys, *arguments)
    assert (status, err) == (0, "") and "11 drawn before, 1 now" in out and path.read_bytes() == whole


def test_command_refuses_a_changed_scene(path, scenes, capsys):
    run(capsys, "film", scenes('{"fails": [3]}'), "--output", path)
    status, out, err = run(capsys, "film", scenes('{"speed": 5}'), "--output", path)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert "scene.speed: 5 here, 6 there" in err and "--restart" in err
    assert run(capsys, "film", scenes('{"speed": 5}'), "--output", path, "--restart")[0] == 0


@pytest.mark.parametrize(
    ("size", "reported"), [((96, 47), "height must be even for a film, but is 47"), ((95, 48), "width")]
)
def test_odd_sizes_are_one_line_before_any_frame_is_drawn(size, reported, path, scenes, capsys):
    status, out, err = run(capsys, "film", scenes(json.dumps({"size": size})), "--output", path)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert f"Scene bar.toml: view.{reported}" in err and not frames_folder(path).exists()


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["none.toml"], "Argument NAME must be a scene file or the name of a film, but there is no file none.toml"),
        (["spin", "--quality", "draft"], "Argument --quality must be used with a scene"),
        (["spin", "--frames", "5:5"], "Argument --frames must be A:B"),
        (["spin", "--frames", "many"], "Argument --frames must be A:B"),
        (["spin", "--workers", "2", "--scheduler", "tcp://x:1"], "only one of them can be given"),
        (["spin", "--json", "no/such/file"], "Argument --json must name a file in a folder"),
        (["BAR", "--frames", "5"], "Argument --frames must be A:B for a scene"),
        (["BAR", "--frames", "5:13"], "Argument --frames must lie within 0:12, which are all, but is 5:13"),
        (["spin", "--scale", "0.5"], "Argument --scale must be used with a scene (.toml), but spin is a script."),
        (["BAR", "--size", "95x48"], "Argument --size must have an even width and height for a film, but is 95x48."),
        (["BAR", "--workers", "0"], "Argument --workers must be 1 or more, but is 0"),
        (["BAR", "--output", "film.avi"], "Argument --output must end in .mp4 or .gif"),
    ],
)
def test_command_refuses(arguments, complaint, assert_refused, scenes):
    bar = scenes()
    assert_refused(["film", *(bar if word == "BAR" else word for word in arguments)], complaint)


def test_a_scene_of_a_sweep_is_no_film(scenes, assert_refused, monkeypatch):
    bar = scenes()
    monkeypatch.setattr(sys.modules["kerrcaustics.sweeps.reading"], "read_scene", lambda _: object())
    assert_refused(["film", bar], "is a sweep file")


@pytest.mark.parametrize("full_at", [0, 1, 6, 12, 13])
def test_a_full_disk_at_any_moment_is_one_line(full_at, path, whole, scenes, capsys, monkeypatch):
    """While the note is written that says what the frames are of, a frame, or the film."""
    left = [full_at]

    def sync(_file):
        left[0] -= 1
        if left[0] < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    scene = scenes()
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", sync)
        status, out, err = run(capsys, "film", scene, "--output", path)
    assert (status, out) == (1, "") and err.count("\n") == 1
    assert f"The film {path} cannot be written: No space left on device. The frames drawn so far are kept in" in err
    assert not path.exists() and not list(path.parent.rglob("*.part"))
    _, drawn = gone_on(path)
    assert drawn == list(range(max(full_at - 1, 0), 12)) and path.read_bytes() == whole


def test_a_read_only_folder_is_one_line(path, scenes, capsys, monkeypatch):
    """The superuser of a container may write anywhere: it is pretended."""
    scene = scenes()
    run(capsys, "film", scenes('{"fails": [3]}'), "--output", path)
    scenes()
    kept = {file.name: file.read_bytes() for file in frames_folder(path).iterdir() if file.suffix == ".png"}

    def refused(*_, **__):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    with monkeypatch.context() as patch:
        patch.setattr("kerrcaustics.files.tempfile.mkstemp", refused)
        status, out, err = run(capsys, "film", scene, "--output", path)
    assert (status, out) == (1, "") and err.count("\n") == 1 and "cannot be written: Read-only file system" in err
    with monkeypatch.context() as patch:
        patch.setattr(Path, "touch", refused)
        status, out, err = run(capsys, "film", scene, "--output", path)
    assert (status, out) == (2, "") and err.count("\n") == 1 and "--output must name a file that can be written" in err
    assert {file.name: file.read_bytes() for file in frames_folder(path).iterdir() if file.suffix == ".png"} == kept


def test_lines_now_and_then_where_there_is_no_terminal(path, scenes, capsys, monkeypatch):
    now = iter(range(0, 10**6, 9))
    monkeypatch.setattr(terminal, "time", SimpleNamespace(monotonic=lambda: next(now)))
    # Lines by reports alone, none by the clock of the machine.
    monkeypatch.setattr(terminal, "FIRST_LINE", 1e6)
    status, _, err = run(capsys, "film", scenes(), "--output", path)
    assert status == 0
    # A report each 9 s, of which three are printed before the first frame is drawn; the first line is due after 20 s.
    lines = err.splitlines()
    assert lines[:3] == ["0 of 12 frames", "3 of 12 frames, 0:01:21 left", "6 of 12 frames, 0:00:54 left"]
    assert lines[3:] == ["9 of 12 frames, 0:00:27 left", "12 of 12 frames"]


def test_frames_are_pngs_that_say_what_they_are_of(path):
    interrupted(path, 2)
    with Image.open(frame(path, 1)) as image:
        assert image.info["kerrcaustics"].split()[1] == "1"
        assert (np.asarray(image) == GOOD.picture(1)).all()
    assert isinstance(scene_film(GOOD), Film)


def test_two_workers_draw_the_same_film(path, whole):
    result, _ = gone_on(path, workers=2)
    assert result.drawn == 12 and path.read_bytes() == whole
