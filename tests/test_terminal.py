"""The output in a terminal of any width, and how a command ends on Ctrl-C."""

import json
import os
import re
import shlex
import subprocess
import sys
import time
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from command_line import run
from offenders import for_each
from rich.console import Console

from kerrcaustics.cli import doctor, film, terminal, with_all_commands
from kerrcaustics.cli.tables import PlainTable
from kerrcaustics.films.film import frames_folder
from kerrcaustics.interrupts import NOTHING_LEFT

ROWS = [("0", "-0.65536 -0.75531 +0.00000", "146.6", "1"), ("1", "-0.26715 -0.15012 +0.95189", "0.02882", "12")]


def shown(width):
    table = PlainTable(("index", "direction N", "magnifi\N{SOFT HYPHEN}cation", "cross\N{SOFT HYPHEN}ings"))
    for row in ROWS:
        table.add_row(*row)
    out = Console(file=StringIO(), width=width)
    out.print(table)
    return out.file.getvalue().rstrip("\n").split("\n")


@pytest.mark.parametrize("width", [120, 80, 56, 48, 42, 30, 20, 8])
def test_tables_keep_all_their_digits_at_any_width(width):
    lines = shown(width)
    assert max(map(len, lines)) <= width
    text = "\n".join(lines)
    assert "…" not in text and "\N{SOFT HYPHEN}" not in text
    for row in ROWS:
        for cell in row:
            assert "".join(cell.split()) in "".join(text.split())


def test_tables_are_set_closer_before_they_are_stacked():
    wide, close, broken, stacked = shown(80), shown(56), shown(48), shown(42)
    assert "direction N  magnification" in wide[0] and "direction N magnification" in close[0]
    assert "magnifi-" in broken[0] and "cation" in broken[1] and len(broken) == len(wide) + 1
    assert stacked[:4] == ["index          0", "direction N    -0.65536 -0.75531 +0.00000", *stacked[2:4]]


def test_work_that_reports_nothing_is_reported_without_a_terminal(capsys, monkeypatch):
    monkeypatch.setattr(terminal, "FIRST_LINE", 0.05)
    with terminal.progress("r = 3: "):
        time.sleep(0.5)
    assert capsys.readouterr().err == "r = 3: computing, 0 s so far\n"
    with terminal.progress() as report:
        report("drawing", 0.9)
        time.sleep(0.5)
    assert capsys.readouterr().err == "drawing, 0 s so far\n"


@pytest.mark.slow
def test_a_long_command_says_so_within_seconds():
    command = "counts --spin 0.99999999 --radius 1.2 --circle 45 0"
    begun = time.monotonic()
    with subprocess.Popen(
        [sys.executable, "-m", "kerrcaustics", *command.split()],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stderr is not None
        assert process.stderr.readline() == "computing, 5 s so far\n" and time.monotonic() - begun < 60
        process.kill()


app = with_all_commands()
COMMANDS = {name: app[name] for name in app if not name.startswith("-")} | {"study report": app["study"]["report"]}


@for_each(name=COMMANDS)
def test_every_command_writes_its_numbers_as_json(name):
    assert "--json" in [option for part in COMMANDS[name].assemble_argument_collection() for option in part.names]


def test_templates_are_reported_as_json(capsys):
    _, out, _ = run(capsys, "scene", "--json", "-")
    assert set(json.loads(out)["templates"]) >= {"stars", "checkerboard", "disk", "film"}
    _, out, _ = run(capsys, "scene", "--template", "stars", "--json", "-")
    assert (json.loads(out)["template"], json.loads(out)["hole"]) == ("stars", {"spin": 0.999})


def scripts_do(monkeypatch, main):
    monkeypatch.setattr(
        "kerrcaustics.scripts.ScriptFolder.run", lambda _self, name, folder, quick=False: main(name, folder)
    )


def test_figures_are_reported_as_json(capsys, tmp_path, monkeypatch):
    def main(name, folder):
        if name == "aberration":
            raise RuntimeError("no light")
        return [folder / f"{name}.png"]

    scripts_do(monkeypatch, main)
    status, out, err = run(capsys, "figures", "aberration", "star_field", "--output", tmp_path, "--json", "-")
    entry = json.loads(out)
    assert (status, entry["schema"], entry["failed"]) == (1, "kerrcaustics/figures/1", ["aberration"])
    assert [made["files"] for made in entry["figures"]] == [[str(tmp_path / "star_field.png")]]
    assert "no light" in err and "star_field.png" in err


def test_the_record_of_a_study_goes_where_it_is_wanted(capsys, tmp_path, monkeypatch):
    def main(name, folder):
        print("a table")
        (folder / f"{name}.json").write_text('{"seconds": 3}')
        return [folder / f"{name}.json"]

    scripts_do(monkeypatch, main)
    status, out, err = run(capsys, "study", "accuracy", "--output", tmp_path, "--json", "-")
    assert (status, json.loads(out)) == (0, {"seconds": 3}) and "a table" in err


@for_each(command=COMMANDS.values())
def test_help_ends_with_lines_to_try_and_the_exit_status(command):
    assert "Exit status: 0 done;" in command.help_epilogue
    tried = re.findall(r"^\$ kerrcaustics (.*?)( >.*)?\s*$", command.help_epilogue, re.M)
    assert tried
    for line, _ in tried:
        parsed, _, _ = app.parse_args(shlex.split(line), exit_on_error=False, print_error=False)
        assert parsed.__module__.startswith("kerrcaustics.cli.")


def test_what_is_there_is_reported_with_three_commands_to_try(capsys):
    status, out, err = run(capsys)
    assert (status, err) == (0, "")
    tried = re.findall(r"^  kerrcaustics (.*?)  ", out, re.M)
    assert len(tried) == 3
    for line in tried:
        app.parse_args(shlex.split(line), exit_on_error=False, print_error=False)
    assert {"caustics", "doctor", "tracks"} <= set(re.findall(r"^  (\S+)", out, re.M))


@pytest.mark.parametrize("flag", ["--quiet", "-q"])
def test_quiet_prints_no_table_and_says_what_is_wrong(flag, capsys, monkeypatch):
    monkeypatch.setattr("kerrcaustics.cli.terminal.quiet_output", False)
    scale = ("scale", "--mass", "4.3e6")
    assert "21.1" in run(capsys, *scale)[1]
    assert run(capsys, *scale, flag) == (0, "", "")
    status, out, _ = run(capsys, flag, *scale, "--json", "-")
    assert status == 0 and json.loads(out)["mass"] == 4.3e6
    status, out, err = run(capsys, "scale", "--mass", "-1", flag)
    assert status == 2 and not out and "--mass must" in err


def test_versions_and_options_that_leak_from_the_parser(capsys):
    assert run(capsys, "-V") == run(capsys, "--version")
    status, _, err = run(capsys, "images", "--spin", 0.5, "--radius", 6, "--star", 80, 10, "--empty-star")
    assert status == 2 and "--empty-star" in err


def test_doctor_says_what_is_missing_and_what_to_do(capsys, tmp_path, monkeypatch):
    """OpenGL itself is tried by the tests of models in space."""
    monkeypatch.setattr("kerrcaustics.draw.space.check_opengl", lambda: None)
    status, out, _ = run(capsys, "doctor", "--json", tmp_path / "doctor.json")
    reported = json.loads((tmp_path / "doctor.json").read_text())
    assert status == 0 and reported["schema"] == "kerrcaustics/doctor/1"
    kernels = reported["kernels"]
    assert kernels["level"] == kernels["levels"][-1] and kernels["count"] > 50 and kernels["problem"] is None
    monkeypatch.setattr(doctor, "installed", lambda wanted: wanted.name not in ("av", "pyvista"))
    status, out, _ = run(capsys, "doctor")
    assert status == 0 and "pip install '.[films,space]'" in out
    assert "not tried, as the extra 'space' is not" in out and re.search(r"films .*no, needs av>=", out)


def test_doctor_lists_development_too_and_names_the_folder_of_gradients(capsys, tmp_path, monkeypatch):
    """And does not advise to install what only work on the package needs."""
    monkeypatch.setattr("kerrcaustics.draw.space.check_opengl", lambda: None)
    monkeypatch.setattr(doctor, "installed", lambda wanted: wanted.name not in ("ruff", "numpyro"))
    _, out, _ = run(capsys, "doctor", "--json", tmp_path / "doctor.json")
    assert re.search(r"lint .*no, needs ruff>=", out) and "pip install '.[inference]'" in out
    programs = json.loads((tmp_path / "doctor.json").read_text())["programs"]
    assert programs["folder"] in out.replace("\n", "") and programs["count"] >= 0


# The first module of the package, the first of Python's own that is loaded then, and later ones.
FIRST = ["kerrcaustics.interrupts", "lazy_loader", "ast", "kerrcaustics.__main__"]
LATER = [
    "kerrcaustics.cli",
    "kerrcaustics.files",
    "tempfile",
    "random",
    "cyclopts",
    "numpy",
    "kerrcaustics.beams.trace",
]
INTERRUPTED = f"kerrcaustics: Interrupted: {NOTHING_LEFT}\n"


IMAGES = ("images", "--spin", "0.5", "--radius", "6", "--star", "80", "10")
# It takes longer than half a second anywhere.
LONG = ("counts", "--spin", "0.999", "--radius", "2.6", "--map", "--rows", "720", "--max-index", "3")


def program(folder, how, arguments=IMAGES):
    """The command line as users start it: as a module, or as the script that pip writes."""
    if how == "module":
        return [sys.executable, "-m", "kerrcaustics", *arguments]
    script = folder / "kerrcaustics"
    script.write_text("import sys\nfrom kerrcaustics.__main__ import main\nsys.exit(main())\n")
    return [sys.executable, str(script), *arguments]


@pytest.mark.parametrize(
    ("module", "how"),
    [*((name, how) for how in ("module", "script") for name in FIRST), *((n, "module") for n in LATER)],
)
def test_an_interrupt_at_any_moment_is_one_line(module, how, tmp_path):
    """While a module is being loaded: Python runs `sitecustomize` before all else.

    In the callback of a weak reference exceptions are swallowed: the locks of imports have one.
    """
    (tmp_path / "sitecustomize.py").write_text(f"""
import os, signal, sys, weakref
class Interrupt:
    def find_spec(name, *_):
        if name == {module!r}:
            lock = type("Lock", (), {{}})()
            end = weakref.ref(lock, lambda _: os.kill(os.getpid(), signal.SIGINT))
            del lock
sys.meta_path.insert(0, Interrupt)
""")
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(Path(__file__).parents[1])])}
    done = subprocess.run(program(tmp_path, how), capture_output=True, text=True, env=env)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", INTERRUPTED)


@pytest.mark.slow
@pytest.mark.parametrize("how", ["module", "script"])
def test_interrupts_from_the_first_moment_on_are_one_line(how, tmp_path):
    """At 60 delays in the first half second after the package is begun; before that there is Python alone."""
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(Path(__file__).parents[1])])}
    for delay in np.linspace(0, 0.5, 60):
        (tmp_path / "sitecustomize.py").write_text(f"""
import os, signal, sys
class Interrupt:
    def find_spec(name, *_):
        if name == "kerrcaustics.interrupts":
            sys.meta_path.remove(Interrupt)
            signal.signal(signal.SIGALRM, lambda *_: os.kill(os.getpid(), signal.SIGINT))
            signal.setitimer(signal.ITIMER_REAL, {delay + 1e-6})
sys.meta_path.insert(0, Interrupt)
""")
        done = subprocess.run(program(tmp_path, how, LONG), capture_output=True, text=True, env=env)
        assert (done.returncode, done.stdout, done.stderr) == (130, "", INTERRUPTED), delay


@pytest.mark.parametrize("start", ["-c", "kerrcaustics.py", "other"])
def test_programs_that_import_the_package_keep_their_own_ctrl_c(start, tmp_path):
    code = "import signal, sys; sys.path.pop(0); own = signal.getsignal(signal.SIGINT); import kerrcaustics; "
    code += "print(signal.getsignal(signal.SIGINT) is own)"
    (tmp_path / start).write_text(code)
    command = [start, code] if start == "-c" else [str(tmp_path / start), "-m", "kerrcaustics"]
    done = subprocess.run([sys.executable, *command], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"


def test_a_warning_is_one_line():
    code = "import sys, warnings; from kerrcaustics.__main__ import main; sys.argv[1:] = ['--version']\n"
    code += "try:\n    main()\nfinally:\n    warnings.warn('It is\\n so.', RuntimeWarning, stacklevel=1)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr == "kerrcaustics: Warning: It is so.\n"


def test_an_interrupted_film_says_what_it_leaves(tmp_path):
    folder = frames_folder(tmp_path / "film.mp4")
    folder.mkdir()
    (folder / "film.json").touch()
    (folder / "000003.png").touch()
    assert film.frames_left_in(folder) == f"1 frame is kept in {folder}; start again to resume."
    (folder / "000004.png").touch()
    assert film.frames_left_in(folder) == f"2 frames are kept in {folder}; start again to resume."
    for number in (3, 4):
        (folder / f"00000{number}.png").unlink()
    assert film.frames_left_in(folder) == NOTHING_LEFT and not folder.exists()


def test_numbers_have_no_negative_zero(capsys):
    _, out, _ = run(capsys, "images", "--spin", 0.5, "--radius", 6, "--star", 90, "-0.0", "--max-index", 0)
    assert "phi' = 0 deg" in out and "+0.00000" in out and not re.search(r"-0(\.0*)?(?![.\d])", out)
