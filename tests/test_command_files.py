"""The files that commands write: checked before anything is computed, and one line if the disk is full."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import run
from offenders import for_each

from kerrcaustics.cli import with_all_commands

APP = with_all_commands()
COMMANDS = {name: APP[name] for name in APP if not name.startswith("-")} | {"study report": APP["study"]["report"]}
PLACE = "--spin 0.9 --radius 10"
LINES = {
    "amplification": f"amplification {PLACE} --star 80 10 --frequency 2",
    "caustics": f"caustics {PLACE}",
    "counts": f"counts {PLACE} --map",
    "check": "check checks.toml",
    "demo": "demo",
    "doctor": "doctor",
    "explore": "explore --no-browser",
    "figures": "figures star_field",
    "film": "film star_field",
    "images": f"images {PLACE} --star 80 10",
    "light-curve": f"light-curve {PLACE} --orbit 8",
    "magnification": f"magnification {PLACE} --star 80 10 --size 1",
    "render": "render scene.toml",
    "rings": f"rings {PLACE} --inclination 60",
    "scale": "scale --mass 1",
    "scene": "scene",
    "study": "study accuracy",
    "study report": "study report",
    "sweep": "sweep sweep.toml",
    "tracks": f"tracks {PLACE} --star-theta 80",
}
# Options that name a file or a folder to be written, and an ending that is right.
WRITTEN = {
    "--figure": ".png",
    "--film": ".gif",
    "--table": ".csv",
    "--save": ".npz",
    "--json": ".json",
    "--page": ".html",
}
OUTPUTS = {"render": ".png", "film": ".gif", "sweep": ".zarr", "study report": ".html"}
# Folders are made where there are none.
FOLDERS = ("demo", "figures", "study")
READ = {"--stars", "--status", "--token-file", "SCENE", "FILE", "FOLDER"}


def written(command):
    """The options of a command that name what it writes, each with an ending."""
    for argument in COMMANDS[command].assemble_argument_collection():
        if argument.name in WRITTEN or argument.name == "--output":
            yield argument.name, WRITTEN.get(argument.name, OUTPUTS.get(command, ""))
        else:
            assert "Path" not in str(argument.hint) or argument.name in READ, argument.name


CASES = [(command, *option) for command in COMMANDS for option in written(command)]
# Formats: of the others any name will do.
ENDINGS = [case for case in CASES if case[1] not in ("--json", "--save") and case[2] not in ("", ".zarr")]


@pytest.fixture
def nothing_computed(tmp_path, monkeypatch):
    """A folder with scenes, where it is an error to trace a ray or to draw."""
    (tmp_path / "scene.toml").write_text(
        "hole = {spin = 0.9}\ncamera = {radius = 10}\nview = {width = 8}\nsky = {kind = 'checkerboard'}\n"
    )
    (tmp_path / "sweep.toml").write_text("spin = 0.9\nradius = 10\n")
    (tmp_path / "checks.toml").write_text("[[caustic]]\nspin = 0.9\nradius = 10\norder = 1\n")
    monkeypatch.chdir(tmp_path)
    for module in ("kerrcaustics.beams.trace", "kerrcaustics.beams.dispatch"):
        monkeypatch.setitem(sys.modules, module, None)
    return tmp_path


def refused(capsys, command, option, value):
    status, out, err = run(capsys, *LINES[command].split(), option, value)
    assert (status, out) == (2, "") and err.count("\n") == 1, (status, out, err)
    assert f"Argument {option} must" in err, err


@for_each("command", "option", "ending", rows=CASES)
def test_a_file_that_cannot_be_written_is_refused_before_anything_is_computed(
    command, option, ending, nothing_computed, capsys
):
    folder = option == "--output" and command in FOLDERS
    refused(capsys, command, option, f"/proc/x{ending}")
    (nothing_computed / "file").touch()
    refused(capsys, command, option, f"file/x{ending}")
    if not folder:
        refused(capsys, command, option, f"none/x{ending}")
        refused(capsys, command, option, f"{'x' * 300}{ending}")
        if ending not in ("", ".zarr"):
            (nothing_computed / f"folder{ending}").mkdir(exist_ok=True)
            refused(capsys, command, option, f"folder{ending}")


@for_each("command", "option", "ending", rows=ENDINGS)
def test_an_ending_that_is_unknown_is_refused_before_anything_is_computed(
    command, option, ending, nothing_computed, capsys
):
    refused(capsys, command, option, "x.bmp")


@for_each(
    "command",
    "complaint",
    rows=[
        ("render none.toml", "Argument SCENE must name a file that can be read: none.toml"),
        ("film none.toml", "there is no file none.toml"),
        ("film scene.toml", "Scene scene.toml has no table [film], and so one frame: add one"),
        ("sweep none.toml", "Argument FILE must name a file that can be read: none.toml"),
        ("sweep scene.toml", "Sweep file scene.toml: unknown key"),
        (f"light-curve {PLACE} --orbit none.toml", "Argument --orbit must name a file that can be read: none.toml"),
        (f"light-curve {PLACE} --orbit scene.toml", "Orbit scene.toml: "),
        (f"counts {PLACE} --stars none.csv", "Argument --stars must name a file that can be read: none.csv"),
        (f"counts {PLACE} --stars scene.toml", "Argument --stars must name a file of lines"),
        ("study report none", "Argument FOLDER must be a folder that exists"),
    ],
)
def test_a_file_that_cannot_be_read_is_refused_before_anything_is_computed(
    command, complaint, nothing_computed, capsys
):
    if "film scene" in command:
        # Scenes are read by modules that trace.
        for module in ("kerrcaustics.beams.trace", "kerrcaustics.beams.dispatch"):
            del sys.modules[module]
    status, out, err = run(capsys, *command.split())
    assert (status, out) == (2, "") and err.count("\n") == 1 and complaint in err, err


FULL = [
    ("images --spin 0.9 --radius 6 --star 80 10 --max-index 0 --figure", ".png"),
    ("amplification --spin 0.9 --radius 6 --star 80 10 --max-index 0 --frequency 2 --table", ".csv"),
    ("caustics --spin 0.9 --radius 6 --orders 1 --save", ".npz"),
    ("render scene.toml --output", ".png"),
    ("scale --mass 1 --json", ".json"),
]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")
@for_each("command", "ending", rows=FULL)
def test_a_full_disk_is_one_line(command, ending, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(
        "hole = {spin = 0.9}\ncamera = {radius = 10}\nview = {width = 8}\nsky = {kind = 'checkerboard'}\n"
    )
    (tmp_path / f"full{ending}").symlink_to("/dev/full")
    status, _, err = run(capsys, *command.split(), f"full{ending}")
    assert status == 1 and err.count("\n") == 1
    assert f"full{ending}" in err and err.endswith(": No space left on device.\n")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")
@pytest.mark.parametrize("arguments", ["scale --mass 1", "scale --mass 1 --json -", "scene --template disk", "--help"])
def test_standard_output_that_is_full_is_one_line(arguments):
    command = [sys.executable, "-m", "kerrcaustics", *arguments.split()]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    line = "kerrcaustics: Standard output cannot be written: No space left on device.\n"
    assert (done.returncode, done.stderr) == (1, line)


def test_all_commands_have_a_line():
    assert set(LINES) == set(COMMANDS)
