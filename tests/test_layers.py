"""The flow of imports: a room uses floors below and listed rooms of its own; the command line starts light."""

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from marks import few

PACKAGE = Path(__file__).parents[1] / "kerrcaustics"
# The floors, from the ground: their rooms and top-level modules, each with those of its own floor that it may import.
FLOORS = {
    "base": {
        "shapes": "",
        "choices": "",
        "files": "",
        "extras": "",
        "interrupts": "",
        "lazy_names": "choices",
        "toml_files": "choices files",
        "workers": "extras files",
        "results": "files lazy_names",
        "numerics": "shapes",
    },
    "engine": {"spacetime": "", "orbits": "spacetime", "beams": "spacetime", "interop": "spacetime"},
    "lensing": {
        "lens_map": "",
        "curves": "lens_map",
        "images": "lens_map curves",
        "level_curves": "lens_map curves images",
        "tracks": "lens_map images level_curves",
        "rings": "lens_map",
        "extended_sources": "lens_map curves images level_curves",
        "light_curves": "lens_map images",
        "waves": "lens_map curves images extended_sources",
        "functional": "curves images",
    },
    "pictures": {"scenes": "", "films": "", "draw": "scenes films", "scene_files": "scenes draw"},
    "apps": {"explorer": "", "sweeps": "", "report": "scripts", "scripts": "", "cli": "explorer sweeps report scripts"},
}
ENTRY_POINTS = {"__init__", "__main__", "skies", "disks", "pictures"}
MODULES = sorted(path.relative_to(PACKAGE) for path in PACKAGE.rglob("*.py"))
HEAVY = {"astropy", "distributed", "jax", "matplotlib", "msgspec", "pyvista", "scipy", "skimage", "xarray", "zarr"}
STARTS = {
    "import": "import kerrcaustics",
    "help": "sys.argv[1:] = ['--help']; runpy.run_module('kerrcaustics', run_name='__main__')",
}
# Commands that end before they trace a ray need no engine: so they answer in a fraction of a second.
AT_ONCE = [
    "--version",
    "images --help",
    "images --spin 2 --radius 6 --star 1 2",
    "figures bogus",
    "film no.toml",
    "render no.toml",
    "render bad.toml",
    "scale --mass 4e6 --distance 8000",
    "scene",
    "scene --template disk",
    "study report no",
    "study --help",
    "sweep no.toml",
    "sweep bad.toml",
]

# What pictures, films, files of scenes, the command line and the explorer need, and no analysis does.
ABOVE = {"matplotlib", "PIL", "cyclopts", "rich", "msgspec", "xarray", "starlette", "pyvista", "zarr"}
LENSING = """
import importlib, pkgutil, sys

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {blocked}:
            raise ImportError(f"{{name}} is blocked")

sys.meta_path.insert(0, Blocked())
import kerrcaustics as kc

for room in {rooms}:
    package = importlib.import_module(f"kerrcaustics.{{room}}")
    for module in pkgutil.walk_packages(getattr(package, "__path__", []), f"{{package.__name__}}."):
        importlib.import_module(module.name)
camera = kc.Camera(spin=0.9, radius=10)
assert len(kc.caustics(camera, 2)) == 2
assert kc.star_images(camera, (1.4, 2.9)).certified
assert kc.magnification(camera, (1.4, 2.9), 0.01).certified
assert len(kc.star_tracks(camera, 1.4, 1).tracks) > 0
"""


@cache
def imports(module: Path) -> tuple[set[str], set[str]]:
    """The modules of the package, or their parts, that a module imports, also inside its functions.

    First all of them, then those that not only type checkers see.
    """
    every: set[str] = set()
    of_types: set[int] = set()
    used: set[str] = set()
    for node in ast.walk(ast.parse((PACKAGE / module).read_text(encoding="utf-8"))):
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            of_types |= {id(one) for part in node.body for one in ast.walk(part)}
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names = imported_names(node)
            every |= names
            used |= names if id(node) not in of_types else set()
    return every, used


def imported_names(node: ast.Import | ast.ImportFrom) -> set[str]:
    """What one line imports of the package."""
    names = [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom):
        assert node.level == 0, f"line {node.lineno}: a relative import"
        names = [f"{node.module}.{name}" for name in names]
    return {name.removeprefix("kerrcaustics.") for name in names if name.startswith("kerrcaustics.")}


def test_rooms_import_lower_floors_and_listed_rooms_only():
    below, allowed = set(), {}
    for rooms in FLOORS.values():
        for room, beside in rooms.items():
            assert set(beside.split()) <= set(rooms), room
            allowed[room] = below | {room} | set(beside.split())
        below = below | set(rooms)
    refused = {}
    for module in MODULES:
        room = module.with_suffix("").parts[0]
        if room not in ENTRY_POINTS:
            refused[str(module)] = {name.split(".")[0] for name in imports(module)[0]} - allowed[room]
    assert {module: rooms for module, rooms in refused.items() if rooms} == {}


def test_no_module_imports_itself_by_way_of_others():
    names = {".".join(path.with_suffix("").parts).removesuffix(".__init__"): path for path in MODULES}
    uses = {}
    for name, path in names.items():
        uses[name] = {part if part in names else part.rpartition(".")[0] for part in imports(path)[1]} & set(names)
    waiting = set(names)
    while free := {name for name in waiting if not uses[name] & waiting - {name}}:
        waiting -= free
    assert waiting == set()


def loaded_by(code: str, packages: set[str]) -> list[str]:
    """The packages that a program has loaded at its end."""
    report = f"atexit.register(lambda: print(*sorted({packages!r} & set(sys.modules)), file=sys.stderr))"
    code = f"import atexit, runpy, sys; {report}; {code}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "Traceback" not in done.stderr
    return done.stderr.splitlines()[-1].split()


@pytest.mark.parametrize("start", STARTS)
def test_start_is_light(start):
    assert loaded_by(STARTS[start], HEAVY) == []


@pytest.mark.parametrize("command", few(AT_ONCE, AT_ONCE[2:8:2]))
def test_commands_that_trace_nothing_load_no_jax(command, tmp_path):
    bad = tmp_path / "bad.toml"
    bad.write_text("spin = ", encoding="utf-8")
    arguments = [str(bad) if word == "bad.toml" else word for word in command.split()]
    run = f"sys.argv[1:] = {arguments!r}; runpy.run_module('kerrcaustics', run_name='__main__')"
    assert loaded_by(run, {"jax", "matplotlib", "scipy"}) == []


def test_the_first_plot_loads_what_it_draws():
    """What other results are drawn by takes half a second to load, a quarter of the time until the plot is there."""
    others = {f"kerrcaustics.draw.{name}_results" for name in ("light", "space", "derivative", "star")}
    others |= {"jax", "kerrcaustics.scenes.render", "kerrcaustics.waves.amplification"}
    others |= {"kerrcaustics.extended_sources.magnification", "kerrcaustics.draw.waves", "kerrcaustics.functional"}
    seen = "star_images(kerrcaustics.Camera(0.9, 10.0), (1.4, 2.9), 1).plot()"
    run = f"import matplotlib; matplotlib.use('agg'); import kerrcaustics; kerrcaustics.{seen}"
    # An empty list would not show that anything was drawn.
    assert loaded_by(run, others | {"kerrcaustics.draw.sky_results"}) == ["kerrcaustics.draw.sky_results"]


def test_analyses_need_no_package_of_pictures_files_or_the_command_line():
    rooms = [room for floor in ("base", "engine", "lensing") for room in FLOORS[floor] if room != "toml_files"]
    code = LENSING.format(blocked=ABOVE, rooms=rooms)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
