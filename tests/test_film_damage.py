"""Frames of unfinished films that are damaged, file by file, and folders of frames that are links."""

import os
import random
import struct
import zlib
from dataclasses import replace

import pytest
from command_line import run
from filming import MovingBar
from harming import HARM, hold_a_folder, restored
from marks import few
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from kerrcaustics.films.film import frames_folder, make_film
from kerrcaustics.films.scene_films import scene_film

GOOD = MovingBar(8)
DRAWN = 5


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The bytes of the film that nobody disturbs."""
    path = tmp_path_factory.mktemp("whole") / "bar.gif"
    make_film(path, scene_film(GOOD))
    return path.read_bytes()


@pytest.fixture
def path(tmp_path):
    return tmp_path / "bar.gif"


@pytest.fixture
def kept(path):
    """The folder of the first frames of a film."""
    make_film(path, scene_film(GOOD), frames=range(DRAWN))
    path.unlink()
    return frames_folder(path)


def gone_on(path, scene=GOOD, **options):
    fresh = replace(scene, drawn=[])
    return make_film(path, scene_film(fresh), **options), fresh.drawn


def halved(path, chance):
    """Half of the pixels are not there, and every checksum of the file is right."""
    content = path.read_bytes()
    parts, place = [content[:8]], 8
    while place < len(content):
        (size,), kind = struct.unpack(">I", content[place : place + 4]), content[place + 4 : place + 8]
        data = content[place + 8 : place + 8 + size]
        if kind == b"IDAT":
            data = data[: size // 2]
        parts.append(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))
        place += 12 + size
    path.write_bytes(b"".join(parts))


def cropped(path, chance):
    """A whole picture of half the height, that says the same of itself."""
    with Image.open(path) as image:
        says = PngInfo()
        says.add_text("kerrcaustics", image.info["kerrcaustics"])
        image.crop((0, 0, image.width, image.height // 2)).save(path, pnginfo=says)


PICTURE_HARM = {**HARM, "halved": halved, "cropped": cropped}


@pytest.mark.parametrize("harm", few(PICTURE_HARM, ("truncated", "cropped", "flipped")))
def test_a_damaged_frame_is_drawn_again(harm, path, kept, whole):
    """The first, one in the middle, and the last."""
    for number in (0, 2, DRAWN - 1):
        PICTURE_HARM[harm](kept / f"{number:06d}.png", random.Random(number))
    result, drawn = gone_on(path)
    assert drawn == [0, 2, DRAWN - 1, *range(DRAWN, 8)] and result.reused == DRAWN - 3
    assert path.read_bytes() == whole and list(path.parent.iterdir()) == [path]


@pytest.mark.slow
@pytest.mark.parametrize("harm", ["truncated", "flipped"])
def test_frames_may_be_damaged_anywhere(harm, path, kept, whole, tmp_path):
    good, chance = restored(kept, tmp_path / "good"), random.Random(5)
    for _ in range(25):
        restored(good, kept)
        HARM[harm](kept / "000001.png", chance)
        # The text beside the pixels may hold a bit that says nothing: then the frame is as good as it was.
        assert gone_on(path)[1] in ([1, *range(DRAWN, 8)], list(range(DRAWN, 8)))
        assert path.read_bytes() == whole


@pytest.mark.parametrize("harm", HARM)
def test_frames_say_their_film_where_its_description_is_damaged(harm, path, kept, whole):
    HARM[harm](kept / "film.json", random.Random(6))
    assert gone_on(path)[1] == list(range(DRAWN, 8))
    assert path.read_bytes() == whole and list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("harm", HARM)
def test_notes_of_failures_may_be_damaged(harm, path, whole):
    gone_on(path, replace(GOOD, fails=(3,)))
    HARM[harm](frames_folder(path) / "000003.failed", random.Random(7))
    assert gone_on(path)[1] == [3] and path.read_bytes() == whole
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("name", ["000003.png", "film.json"])
def test_a_folder_with_something_in_it_is_one_line_before_a_frame_is_drawn(name, path, kept):
    hold_a_folder(kept / name)
    with pytest.raises(OSError, match=f"a folder is in the place of the file {kept / name}"):
        gone_on(path)
    assert (kept / name / "notes.txt").read_text() == "mine"
    assert len(list(kept.glob("*.png"))) == DRAWN


@pytest.fixture
def linked(path, tmp_path):
    """A folder elsewhere, with pictures of the user, that a link names as the folder of frames."""
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    for name in ("holiday.png", "1.png", "x000001.png", ".notes.part", "notes.failed"):
        (folder / name).write_text("mine")
    frames_folder(path).symlink_to(folder)
    return folder


def of_the_user(folder):
    return {file.name for file in folder.iterdir() if file.is_file() and file.read_bytes() == b"mine"}


def test_frames_may_lie_behind_a_link(path, linked, whole):
    """The film is done, and not a file that is not its own is gone."""
    before = of_the_user(linked)
    make_film(path, scene_film(GOOD), frames=range(DRAWN))
    assert len(list(linked.glob("0*.png"))) == DRAWN
    result, drawn = gone_on(path)
    assert (result.output, drawn) == (path, list(range(DRAWN, 8))) and path.read_bytes() == whole
    assert {file.name for file in linked.iterdir()} == before == of_the_user(linked)
    assert frames_folder(path).is_symlink()
    make_film(path, scene_film(GOOD), frames=range(2))
    assert gone_on(path, restart=True)[1] == list(range(8)) and path.read_bytes() == whole
    assert {file.name for file in linked.iterdir()} == before == of_the_user(linked)


def test_a_linked_folder_is_status_0(path, linked, capsys, monkeypatch):
    (path.parent / "bar.toml").write_text("")
    monkeypatch.setattr("kerrcaustics.cli.film.film_of_scene_file", lambda *_: scene_film(GOOD))
    status, out, err = run(capsys, "film", path.parent / "bar.toml", "--output", path)
    assert (status, err) == (0, "") and "frames are kept" not in out


def test_numbered_pictures_of_somebody_else_are_not_thrown_away(path, linked):
    (linked / "000001.png").write_text("mine")
    before = of_the_user(linked)
    for restart in (True, False):
        with pytest.raises(ValueError, match=r"film\.json"):
            gone_on(path, restart=restart)
        assert of_the_user(linked) == before


@pytest.mark.parametrize("make", [os.mkfifo, lambda place: place.symlink_to("nowhere"), lambda place: place.touch()])
def test_what_is_no_folder_is_one_line(make, path):
    make(frames_folder(path))
    with pytest.raises(OSError, match="neither a folder nor a link to one"):
        gone_on(path)
