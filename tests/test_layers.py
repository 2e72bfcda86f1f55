"""The flow of imports: a stage uses earlier stages only, and the command line starts light."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "kerrcaustics"
STAGES = [
    "choices",
    "lazy_names",
    "files",
    "extras",
    "interrupts",
    "own_folder",
    "workers",
    "toml_files",
    "results",
    "films",
    "spacetime",
    "astronomy",
    "beams",
    "functional",
    "lens_map",
    "curves",
    "images",
    "tracks",
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


def imported_stages(module: Path) -> set[str]:
    """What follows `kerrcaustics.` in the imports of a module, also of those inside its functions."""
    names = []
    for node in ast.walk(ast.parse((PACKAGE / module).read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"line {node.lineno}: a relative import"
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return {(name + ".").split(".")[1] for name in names if name.split(".")[0] == "kerrcaustics"}


@pytest.mark.parametrize("module", MODULES, ids=str)
def test_stage_imports_earlier_stages_only(module):
    stage = module.with_suffix("").parts[0]
    if stage not in ENTRY_POINTS:
        assert imported_stages(module) <= set(STAGES[: STAGES.index(stage) + 1])


@pytest.mark.parametrize("start", STARTS)
def test_start_is_light(start):
    report = f"atexit.register(lambda: print(sorted({HEAVY!r} & set(sys.modules)), file=sys.stderr))"
    code = f"import atexit, runpy, sys; {report}; {STARTS[start]}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.splitlines()[-1] == "[]"
