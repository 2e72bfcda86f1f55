"""Angles on the command line: refusals state them as they were typed, in degrees, and radians are noted."""

import re

import pytest
from command_line import run
from offenders import for_each

from kerrcaustics.choices import place_if_radians
from kerrcaustics.cli import with_all_commands

APP = with_all_commands()
COMMANDS = {name: APP[name] for name in APP if not name.startswith("-")}
PLACE = "--spin 0.9 --radius 10"
# Command lines with an angle that is refused; what other options need is beside it.
REFUSED = {
    "--inclination": ["200", "-1", "nan"],
    "--star": ["200 10", "-3.5 10", "80 nan"],
    "--star-theta": ["190"],
    "--circle": ["190 0", "80 inf"],
    "--line": ["nan"],
    "--angle": ["nan"],
    "--position-angle": ["inf"],
    "--size": ["-1", "0", "178", "nan"],
    "--stars": ["theta,phi\n200,10\n", "80,nan\n"],
    "--orbit": [
        'kind = "geodesic"\nradius = 8\ntheta = 200\n',
        'kind = "kepler"\nsemi_major_axis = 100\ninclination = -1\n',
    ],
}
OTHERS = {
    "amplification": "--star 80 10 --frequency 2",
    "images": "--star 80 10",
    "light-curve": "--orbit 8",
    "magnification": "--star 80 10 --size 1",
    "rings": "--observer --baselines 1",
    "tracks": "--star-theta 80",
}


def angles():
    """The options that take degrees, by what their help says: the command and the name."""
    for name, command in COMMANDS.items():
        for argument in command.assemble_argument_collection(parse_docstring=True):
            if "degrees" in (argument.parameter.help or ""):
                yield name, argument.name


def command_line(command, option, value):
    """The words of a command with a value of an option, the others as they are needed."""
    needed = OTHERS.get(command, "--circle 80 10" if option == "--line" else "")
    if command == "counts" and option == "--inclination":
        needed = "--star 80 10"
    kept = re.sub(rf"{option}( -?[\w.]+)+", "", needed).split()
    return [command, *PLACE.split(), *kept, option, *value]


@for_each("command", "option", rows=angles())
def test_refusals_state_angles_as_they_were_typed(command, option, tmp_path, capsys):
    for value in REFUSED[option]:
        if in_file := "\n" in value:
            (tmp_path / "file.toml").write_text(value)
            number = re.findall(r"-?\d+\b|nan", value)[-1 if "kepler" in value or "80" in value else -2]
            number = "200" if "200" in value else number
        else:
            number = next(word for word in value.split() if word not in ("10", "80"))
        words = [str(tmp_path / "file.toml")] if in_file else value.split()
        status, out, err = run(capsys, *command_line(command, option, words))
        assert (status, out) == (2, "") and err.count("\n") == 1, err
        assert f" {number}." in err and not re.search(r"radian|\bpi\b", err), err


@for_each(
    command=[
        "images --star 6 45",
        "counts --star 6 45",
        "counts --map",
        "magnification --star 6 45 --size 0.5",
        "tracks --orbit 6",
        "caustics",
        "light-curve --orbit 6",
    ]
)
def test_a_camera_in_the_plane_of_its_sources_is_told_an_inclination_to_try(command, capsys):
    plane = [] if command.startswith("light-curve") else ["--plane", "1"]
    status, out, err = run(capsys, *command.split(), *PLACE.split(), *plane, "--inclination", "90")
    assert (status, out) == (2, "") and err.count("\n") == 1 and "try 60." in err and len(err) < 130


def test_the_default_inclination_is_one_that_works(capsys):
    images = ("images", "--spin", 0.9, "--radius", 10, "--max-index", 0, "--star")
    status, out, _ = run(capsys, *images, 6, 45, "--plane", 1)
    assert status == 0 and "inclination 60 deg" in out
    assert "inclination 90 deg" in run(capsys, *images, 80, 10)[1]
    light = ("light-curve", "--spin", 0.9, "--radius", "inf", "--orbit", 8, "--times", 3, "--crossings", 1)
    status, out, err = run(capsys, *light)
    assert (status, err) == (0, "") and "inclination 60 deg" in out


@pytest.mark.parametrize(
    ("place", "degrees"),
    [
        ((1.77, -1.07), "101.414 -61.3065"),
        ((3.14159, 0.0), "180 0"),
        ((1.0, 2.0), ""),
        ((0.0, 0.5), ""),
        ((80.0, 1.5), ""),
        ((1.5, 40.0), ""),
    ],
)
def test_a_place_that_looks_like_radians(place, degrees):
    line = place_if_radians("--star", *place)
    assert degrees in line and bool(line) == bool(degrees)


@for_each(
    command=[
        f"{command} {PLACE} {others}"
        for command, others in {
            "amplification": "--frequency nonsense --star 1.77 -1.07",
            "images": "--star 1.77 -1.07 --velocity static --observer",
            "counts": "--circle 1.77 -1.07 --velocity static --observer",
            "counts ": "--star 1.77 -1.07 --velocity static --observer",
            "magnification": "--size 1 --star 1.77 -1.07 --velocity static --observer",
        }.items()
    ]
)
def test_every_command_notes_places_that_look_like_radians(command, capsys):
    """The last option is refused, before anything is traced."""
    command = command.replace("--frequency nonsense", "--frequency 2 --velocity static --observer")
    _, _, err = run(capsys, *command.split())
    assert re.search(r"^Note: --(star|circle) is in degrees, but 1.77 -1.07 looks like radians: ", err)


def test_help_says_where_the_azimuth_of_a_star_is_zero():
    for command in ("amplification", "counts", "images", "magnification"):
        arguments = COMMANDS[command].assemble_argument_collection(parse_docstring=True)
        (star,) = [one for one in arguments if one.name == "--star"]
        assert "the camera lies at phi' = 0" in star.parameter.help
