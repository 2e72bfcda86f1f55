"""The flow of imports: a stage uses earlier stages only, and the command line starts light."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest
from marks import few

PACKAGE = Path(__file__).parents[1] / "kerrcaustics"
STAGES = [
    "shapes",
    "choices",
    "lazy_names",
    "files",
    "extras",
    "interrupts",
    "workers",
    "toml_files",
    "results",
    "films",
    "numerics",
    "spacetime",
    "orbits",
    "astronomy",
    "beams",
    "lens_map",
    "curves",
    "images",
    "functional",
    "tracks",
    "extended_sources",
    "light_curves",
    "waves",
    "scenes",
    "draw",
    "sweeps",
    "scene_files",
    "explorer",
    "scripts",
    "report",
    "cli",
]
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
    "sweep no.toml",
    "sweep bad.toml",
]


def imported_stages(module: Path) -> set[str]:
    """The names after `kerrcaustics.` in the imports of a module, also of those inside its functions."""
    names = []
    for node in ast.walk(ast.parse((PACKAGE / module).read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"line {node.lineno}: a relative import"
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return {(name + ".").split(".")[1] for name in names if name.split(".")[0] == "kerrcaustics"}


def test_stages_import_earlier_stages_only():
    later = {}
    for module in MODULES:
        stage = module.with_suffix("").parts[0]
        if stage not in ENTRY_POINTS:
            later[str(module)] = imported_stages(module) - set(STAGES[: STAGES.index(stage) + 1])
    assert {module: stages for module, stages in later.items() if stages} == {}


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
