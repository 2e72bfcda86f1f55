"""The command line as a user meets it: its output, its complaints, and what it leaves behind."""

import json
import os
import signal
import subprocess
import sys

import pytest
from command_line import run
from offenders import for_each

import kerrcaustics as kc
from kerrcaustics.cli import terminal

COMMAND = [sys.executable, "-m", "kerrcaustics"]


def caustics(capsys, *arguments, spin=0.5, radius=6.0):
    return run(capsys, "caustics", "--spin", spin, "--radius", radius, *arguments)


def test_table_json_figure_and_file_agree(capsys, tmp_path):
    numbers, picture, stored = (tmp_path / name for name in ("out.json", "out.png", "out.npz"))
    status, out, err = caustics(
        capsys, "--orders", 2, "--json", numbers, "--figure", picture, "--save", stored, spin=0.999, radius=6.03
    )
    assert (status, err) == (0, "")
    assert "0.4232688" in out and "263.0179664" in out and "astroid" in out
    entry = json.loads(numbers.read_text())
    assert [curve["order"] for curve in entry["curves"]] == [1, 2]
    assert entry["curves"][1]["phi_extent_deg"] == pytest.approx(263.0179664, abs=1e-7)
    assert entry["velocity"] == "circular" and entry["beams"] > 1000
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert kc.load(stored)[1].circuits == entry["curves"][1]["circuits"]
    assert sorted(f.name for f in tmp_path.iterdir()) == ["out.json", "out.npz", "out.png"]
    assert out.endswith(f"Figure: {picture}\nSaved: {stored}\n")


def test_json_on_standard_output_is_alone_there(capsys):
    status, out, err = caustics(capsys, "--orders", 1, "--json", "-", "--points", "--inclination", 60)
    assert status == 0
    entry = json.loads(out)
    assert entry["inclination_deg"] == 60 and entry["velocity"] == "fiducial"
    assert len(entry["curves"][0]["sky"]) == len(entry["curves"][0]["celestial_deg"]) > 100
    assert "astroid" in err


@pytest.mark.parametrize(
    "place",
    [
        ("--star", 80, 170),
        pytest.param(("--plane", 1, "--star", 8, 45, "--inclination", 60), marks=pytest.mark.slow),
    ],
)
def test_images_are_drawn_and_the_file_is_named_beside_the_json(capsys, tmp_path, place):
    picture = tmp_path / "images.svg"
    where = ("--spin", 0.5, "--radius", 6, "--max-index", 0)
    status, out, err = run(capsys, "images", *where, *place, "--figure", picture, "--json", "-")
    assert status == 0 and json.loads(out)["certified"] and err.endswith(f"Figure: {picture}\n")
    text = picture.read_text(encoding="utf-8")
    inclination = 60 if "--plane" in place else 90
    assert f"spin 0.5, radius 6, inclination {inclination} deg" in text and "index 0" in text and "source" in text


def test_a_point_is_said_to_be_one(capsys):
    status, out, _ = caustics(capsys, "--orders", 1, spin=0)
    assert status == 0 and "point" in out and "not larger than its error" in out


BAD = [
    (("caustics", "--spin", "1", "--radius", "6"), "--spin must lie in [0, 1), but is 1."),
    (
        ("caustics", "--spin", "-0.1", "--radius", "6"),
        "--spin must lie in [0, 1), but is -0.1: the mirror image",
    ),
    (("caustics", "--spin", "nan", "--radius", "6"), "--spin must be a finite number, but is nan."),
    (("caustics", "--spin", "fast", "--radius", "6"), "Argument --spin must be a number, but is fast."),
    (("caustics", "--spin", "0.9", "--radius", "1.4"), "--radius must be larger than the horizon radius 1.43588989435"),
    (
        ("light-curve", "--spin", "0.9", "--radius", "inf", "--velocity", "static", "--orbit", "6"),
        "Argument --velocity must be fiducial at infinity, but is static.",
    ),
    (
        ("light-curve", "--spin", "0.9", "--radius", "inf", "--orbit", "6", "--inclination", "90"),
        "Argument --inclination must not be 90 degrees, the equatorial plane, as the sources lie in that plane",
    ),
    (("caustics", "--spin", "0.9"), "Argument --radius must be given."),
    (("caustics", "--spin", "0.9", "--radius", "6", "--inclination", "181"), "--inclination must lie in [0, 180] deg"),
    (
        ("caustics", "--spin", "0.9", "--radius", "1.9", "--velocity", "static"),
        "--velocity must not be static at or inside",
    ),
    (
        ("caustics", "--spin", "0.9", "--radius", "6", "--inclination", "60", "--velocity", "circular"),
        "--velocity must not be circular off the equator",
    ),
    (
        ("caustics", "--spin", "0.9", "--radius", "1.5", "--velocity", "circular"),
        "--velocity must not be circular at or inside the photon orbit",
    ),
    (("caustics", "--spin", "0.9", "--radius", "6", "--velocity", "warp"), "must be circular, fiducial or static, but"),
    (("caustics", "--spin", "0.9", "--radius", "6", "--orders", "0"), "--orders must be a whole number from 1 to 10"),
    (("caustics", "--spin", "0.9", "--radius", "6", "--orders", "2.5"), "--orders must be a whole number, but is 2.5."),
    (("caustics", "--spin", "0.9", "--radius", "6", "--json", "x", "--save", "x"), "--json must name a different file"),
    (("caustics", "--spin", "0.9", "--radius", "6", "--tolerance", "1e-9"), "--tolerance"),
    (
        ("caustics", "--spin", "0.9", "--radius", "6", "--json", "/nowhere/x.json"),
        "--json must name a file in a folder",
    ),
    (("caustics", "--spin", "0.9", "--radius", "6", "--save", "/"), "--save must name a file, but / is a folder."),
    (("caustics", "--spin", "0.9", "--radius", "6", "--figure", "x.bmp"), "--figure must end in .png, .pdf, .svg"),
    (
        ("caustics", "--spin", "0.9", "--radius", "6", "--colour", "red"),
        "Argument --colour is unknown; kerrcaustics caustics",
    ),
    (
        ("images", "--a", "0.9", "--r", "4"),
        "Arguments --a and --r are unknown, and arguments --spin, --radius and --star must be given; kerrcaustics i",
    ),
    (("images",), "Arguments --spin, --radius and --star must be given."),
    (("images", "--spn", "0.9"), "--spn is unknown; did you mean --spin? Arguments --radius and --star must be given."),
    (
        ("images", "--spin", "0.9", "--radius", "4", "--star", "80", "1", "--foo", "1", "--bar", "2"),
        "Arguments --foo and --bar are unknown; kerrcaustics images --help lists all options.",
    ),
    (("counts", "--no-map"), "did you mean --map? Arguments --spin and --radius must be given."),
    (("film", "--foo", "x", "--bar"), "Arguments --foo and --bar are unknown; kerrcaustics film --help lists all"),
    (("paint",), "Argument COMMAND must be one of amplification, caustics, check, counts, "),
    (("caustic",), "but is caustic; did you mean caustics?"),
    (("caustics", "--radius", "6"), "Argument --spin must be given."),
    (("caustics", "--spin", "--radius", "6"), "Argument --spin must be followed by a number."),
    (("caustics", "--spn", "0.9", "--radius", "6"), "Argument --spn is unknown; did you mean --spin?"),
    (("caustics", "--spin", "0.9", "--radius", "6", "--order", "2"), "--order is unknown; did you mean --orders?"),
    (("caustics", "--spin", "0.9", "--radius", ""), "Argument --radius must be a number, but is empty."),
    (("caustics", "--spin", "0.9", "--radius", "6,03"), "--radius must be a number, but is 6,03; did you mean 6.03?"),
    (
        ("images", "--spin", "0.9", "--radius", "6", "--star", "84,0", "60"),
        "must be 2 numbers, but is 84,0; did you mean 84.0?",
    ),
    (("caustics", "--spin", "0.9", "--radius", "6", "7"), "Argument --radius must be a number, but is 6 7."),
    (("caustics", "--spin", "0.9", "--radius", "6", "--spin", "1"), "Argument --spin must be given only once."),
    (
        ("caustics", "--spin", "0.9", "--radius", "6", "--points=no way"),
        "--points must be true or false, but is no way.",
    ),
    (("caustics", "--spin", "0.9", "--radius", "6", "--velocity", "circle"), "but is circle; did you mean circular?"),
    (("caustics", "--spin", "0.9", "--radius", "6", "--engine", "warp"), "--engine must be auto, closed-form or integ"),
    (("images", "--spin", "0.9", "--radius", "6", "--star", "90"), "Argument --star must be 2 numbers, but is 90."),
    (("images", "--spin", "0.9", "--radius", "6", "--star", "9", "9", "x"), "--star must be 2 numbers, but is 9 9 x."),
    (("counts", "--spin", "0.9", "--radius", "6", "--empty-star"), "--empty-star is unknown; kerrcaustics counts"),
    (("counts", "--spin", "0.9", "--radius", "6", "--no-map"), "Argument --no-map is unknown; did you mean --map?"),
    (("render", "x.toml", "--empty-overrides"), "Argument --empty-overrides is unknown"),
    (("render", "x.toml", "--set"), "Argument --set must be followed by a value."),
    (("render", "x.toml", "--frame", "x"), "kerrcaustics: Argument --frame must be a whole number, but is x."),
    (("scene", "x"), "Argument x must be left out: kerrcaustics scene has no place for it."),
    (("study",), "Argument NAME must be given."),
    (("scale", "--mass", "x"), "Argument --mass must be a number, but is x."),
]


HERE = ("caustics", "--spin", "0.9", "--radius", "6")
BAD += [
    ((*HERE, "--figure", ""), "Argument --figure must be a name, but is empty."),
    ((*HERE, "--save", ""), "Argument --save must be a name, but is empty."),
    ((*HERE, "--json", ""), "Argument --json must be a file name or -, but is empty."),
    (("light-curve", *HERE[1:], "--orbit", "6", "--film", ""), "Argument --film must be a name, but is empty."),
    (
        ("light-curve", *HERE[1:], "--orbit", "6", "--times", "0"),
        "--times must be a whole number from 1 to 1000000",
    ),
    (("explore", "--no-browser", "--host", ""), "Argument --host must be an address, but is empty."),
    (("demo", "--output", ""), "Argument --output must be a name, but is empty."),
    (("figures", "--output", ""), "Argument --output must be a name, but is empty."),
    (("study", "fit", "--output", ""), "Argument --output must be a name, but is empty."),
    (("study", "report", ""), "Argument FOLDER must be a name, but is empty."),
    (("demo", "--output", "/proc/x"), "Argument --output must be a folder that can be made: /proc/x: No such file"),
    (("demo", "--output", "/proc"), "Argument --output must be a folder that can be written to: /proc/x: No such"),
    (("demo", "--output", sys.executable), "must be a folder that can be made: " + sys.executable + ": it is a file."),
    ((*HERE, "--save", "x.fits"), "Argument --save must name a file of NumPy arrays, such as .npz, but is x.fits."),
    (("explore", "--page", "x.png"), "Argument --page must end in .html or .htm, but is x.png."),
    ((*HERE, "--save", sys.executable + "/x"), "in a folder that exists, but " + sys.executable + " is not a folder."),
]

LIGHT = ("light-curve", *HERE[1:], "--orbit", "8")
STAR = ("images", *HERE[1:], "--star")
BAD += [
    ((*HERE[:2], "\N{MINUS SIGN}0.9", *HERE[3:]), "but is \N{MINUS SIGN}0.9; did you mean -0.9?"),
    ((*HERE, "--inclination", "60\N{DEGREE SIGN}"), "must be a number, but is 60\N{DEGREE SIGN}; did you mean 60?"),
    ((*HERE, "--inclination", "60 deg"), "must be a number, but is 60 deg; did you mean 60?"),
    ((*HERE, "--inclination="), "Argument --inclination must be a number, but is empty."),
    ((*HERE, "--orders", "2,0"), "Argument --orders must be a whole number, but is 2,0."),
    (("scale", "--mass", "4,300,000"), "Argument --mass must be a number, but is 4,300,000; did you mean 4300000?"),
    (("scale", "--mass", "1e300"), "Argument --mass must lie in [1e-100, 1e+100] solar masses, but is 1e+300."),
    (("amplification", *STAR[1:], "80", "9", "--frequency", "1,5"), "LOW:HIGH:COUNT, but is 1,5; did you mean 1.5?"),
    (("scale", "--mass", "4.3e6Msun"), "Argument --mass must be a number, but is 4.3e6Msun; did you mean 4.3e6?"),
    ((*STAR, "80,170"), "Argument --star must be 2 numbers, but is 80,170; did you mean 80 170?"),
    ((*LIGHT, "--during", "0"), "Argument --during must be 2 numbers, but is 0."),
    ((*LIGHT, "--during", "0", "inf"), "Argument --during must be two finite times, the earlier first, but is 0 inf."),
    ((*LIGHT[:-1], "8,5"), "Argument --orbit must be a radius or name a TOML file, but is 8,5; did you mean 8.5?"),
    ((*LIGHT, "--restart"), "Argument --restart must be used with --film."),
    (("tracks", *HERE[1:], "--star-theta", "80", "--restart"), "Argument --restart must be used with --film."),
    (
        ("caustics", "-spin", "0.9", "radius=6"),
        "-spin is unknown; did you mean --spin? Argument radius is unknown; did",
    ),
    ((*HERE, "-orders", "2"), "Argument -orders is unknown; did you mean --orders?"),
    (("caustics", "--SPIN", "0.9", "--radius", "6"), "Argument --SPIN is unknown; did you mean --spin?"),
    (("render", "/"), "Argument SCENE must name a file, but / is a folder."),
    (("render", "disk"), "disk is a template: kerrcaustics scene --template disk > disk.toml writes it to one."),
    (("film", "star_field", "--workers", "0"), "Argument --workers must be 1 or more, but is 0."),
    (("sweep", "--status", "x.zarr", "--retry"), "Argument --retry must not be used with --status."),
    (("sweep", "--status", "x.zarr", "--workers", "2"), "Argument --workers must not be used with --status."),
]
DISC = ("magnification", *HERE[1:], "--star", "80", "170", "--size", "1", "--profile")
BAD += [
    ((*DISC, "foo"), "must be uniform, linear:u, quadratic:u1,u2 or gaussian:width, but is foo."),
    ((*DISC, "Linear:0.6"), "or gaussian:width, but is Linear:0.6; did you mean linear?"),
    ((*DISC, "linear"), "Argument --profile must be linear:u, but is linear."),
    ((*DISC, "linear:0,6"), "Argument --profile must be linear:u, but is linear:0,6."),
    ((*DISC, "linear:x"), "Argument --profile must have numbers after linear:, but has x."),
    ((*DISC, "gaussian:0.1"), 'a width from 0.2 to 1000 radii of the source after "gaussian", but has 0.1.'),
]


@for_each("arguments", "complaint", rows=BAD)
def test_bad_input_gets_one_line_and_exit_status_2(arguments, complaint, assert_refused):
    assert_refused(arguments, complaint)


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write anywhere")
def test_a_folder_without_permission_is_refused(capsys, tmp_path):
    tmp_path.chmod(0o500)
    status, _, err = caustics(capsys, "--save", tmp_path / "x.npz")
    assert status == 2 and "--save must name a file that can be written" in err


@pytest.mark.parametrize(
    ("arguments", "package"),
    [
        ((*HERE, "--orders", "{}"), ("caustics", "orders")),
        (("images", *HERE[1:], "--star", "90", "0", "--max-index", "{}"), ("star_images", "max_index")),
        (("light-curve", *HERE[1:], "--orbit", "6", "--crossings", "{}"), ("light_curve", "crossings")),
    ],
)
def test_limits_are_those_of_the_package_and_reported_before_it_is_loaded(arguments, package, capsys, monkeypatch):
    function, name = package
    places = {"star": (1.0, 1.0)} if function == "star_images" else {"orbit": 6.0} if function == "light_curve" else {}
    with pytest.raises(ValueError, match=f"Argument `{name}` must be a whole number from") as caught:
        getattr(kc, function)(kc.Camera(0.9, 6.0), **places, **{name: 99})
    monkeypatch.setitem(sys.modules, "kerrcaustics.spacetime.camera", None)
    status, out, err = run(capsys, *(word.format(99) for word in arguments))
    reported = str(caught.value).replace(f"`{name}`", f"--{name.replace('_', '-')}")
    assert (status, out, err) == (2, "", f"kerrcaustics: {reported}\n")


def test_words_in_brackets_are_no_markup(capsys):
    """In what is said, as in file names."""
    terminal.say(terminal.console(), 'pip install ".[films]" :smile: [red]')
    assert capsys.readouterr().out == 'pip install ".[films]" :smile: [red]\n'


def test_anything_else_is_exit_status_1_and_one_line(capsys, monkeypatch):
    def fail(*_, **__):
        raise RuntimeError("the sky\nis falling")

    monkeypatch.setattr("kerrcaustics.curves.caustic_search.caustics", fail)
    status, _, err = caustics(capsys)
    assert status == 1 and err.count("\n") == 1 and "RuntimeError: the sky is falling" in err


@pytest.mark.slow
def test_names_of_files_need_not_be_text(tmp_path):
    """Bytes that are no UTF-8 are shown as escapes, and the files are written."""
    name = os.fsdecode(b"caf\xe9")
    command = [sys.executable, "-m", "kerrcaustics", "caustics", "--spin", "0.5", "--radius", "6", "--orders", "1"]
    command += ["--json", f"{name}.json", "--save", f"{name}.npz"]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    assert ran.returncode == 0, ran.stderr
    assert "caf\\udce9.npz" in ran.stdout
    assert {file.suffix for file in tmp_path.iterdir()} == {".json", ".npz"}


def test_interrupt_leaves_no_file(tmp_path):
    target = tmp_path / "out.json"
    command = [*COMMAND, "caustics", "--spin", "0.999", "--radius", "2.6", "--orders", "1", "--json", str(target)]
    # The command says when it has begun, and then takes far longer than a test waits.
    code = (
        "import sys; from kerrcaustics.__main__ import main\n"
        "import kerrcaustics.curves.caustic_search as c; find = c.find_features\n"
        "def slow(*a):\n    print('begun', flush=True)\n    import time; time.sleep(60)\n    return find(*a)\n"
        f"c.find_features = slow; sys.argv = {command[2:]!r}; main()"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout.readline() == b"begun\n"
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=60) == 130
    # On a busy machine lines about progress come before it.
    assert process.stderr.read().splitlines()[-1] == b"kerrcaustics: Interrupted: nothing was left half-written."
    assert list(tmp_path.iterdir()) == []


def test_folders_that_cannot_be_written_to_are_no_news(tmp_path):
    code = "import sys; from kerrcaustics import cli; sys.argv[1:] = ['scale', '--mass', '1']\n"
    code += "try:\n    cli.main()\nfinally:\n    import matplotlib; matplotlib.get_cachedir()"
    surroundings = {**os.environ, "HOME": "/proc/no", "XDG_CACHE_HOME": "/proc/no", "TMPDIR": str(tmp_path)}
    surroundings.pop("MPLCONFIGDIR", None)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=surroundings, check=True)
    assert done.stderr == ""


def test_version_and_help():
    """The test of the layers checks that they start light."""
    done = subprocess.run([*COMMAND, "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == kc.__version__
    done = subprocess.run([*COMMAND, "--help"], capture_output=True, text=True, check=True)
    listed = {line.split()[1] for line in done.stdout.splitlines() if len(line.split()) > 2}
    assert {"caustics", "images", "counts", "tracks", "film", "figures", "study", "sweep", "demo"} <= listed
