"""The command `doctor`: the state of the installation, and advice about missing parts."""

import platform
import sys
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from rich.console import Console

from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.options import COMMON, CommonOptions
from kerrcaustics.cli.tables import PlainTable
from kerrcaustics.cli.terminal import progress, say
from kerrcaustics.extras import DEVELOPMENT, EXTRAS, install


@app.command(**with_examples("doctor"))
def doctor(*, common: CommonOptions = COMMON) -> None:
    """List what is installed and what is missing: extras, device, kernels, OpenGL."""
    common.check()
    with progress() as report:
        report("looking at the device", 0.2)
        device = _device()
        report("trying OpenGL", 0.6)
        extras = {name: _missing(name) for name in EXTRAS}
        opengl = _opengl(tried=not extras["space"])
    entry = {
        "schema": "kerrcaustics/doctor/1",
        "version": version("kerrcaustics"),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": {name: version(name) for name in ("jax", "jaxlib", "numpy", "scipy", "matplotlib")},
        "device": device,
        "extras": {name: {"installed": not missing, "missing": missing} for name, missing in extras.items()},
        "opengl": opengl,
        "kernels": _kernels(),
        "programs": _programs(),
    }
    common.write(entry)
    _print(entry, common.console())


def _device() -> str:
    """The device that computes, in words."""
    from kerrcaustics.beams.accelerator import name_of_device
    from kerrcaustics.beams.trace import cores
    from kerrcaustics.report.machine import processor

    found, accelerator = f"{processor()}, {cores()} cores", name_of_device()
    return f"{found}; {accelerator} for many rays" if accelerator else found


def _missing(extra: str) -> list[str]:
    """Requirements of an extra that are not installed, or too old."""
    requirements = [Requirement(line) for line in requires("kerrcaustics") or []]
    own = (r for r in requirements if _applies(r, extra) and not _applies(r, ""))
    return [f"{r.name}{r.specifier}" for r in own if not installed(r)]


def _applies(requirement: Requirement, extra: str) -> bool:
    return requirement.marker is None or requirement.marker.evaluate({"extra": extra})


def installed(requirement: Requirement) -> bool:
    """True if the package is there in a version that serves."""
    try:
        return requirement.specifier.contains(version(requirement.name), prereleases=True)
    except PackageNotFoundError:
        return False


def _opengl(tried: bool) -> dict[str, Any]:
    """State of OpenGL, None if it is not tried, and advice."""
    if not tried:
        return {"works": None, "advice": "not tried, as the extra 'space' is not installed"}
    from kerrcaustics.draw.space import NoOpenGLError, check_opengl

    try:
        check_opengl()
    except NoOpenGLError as error:
        return {"works": False, "advice": str(error)}
    return {"works": True, "advice": "works without a screen"}


def _kernels() -> dict[str, Any]:
    """The instruction set of the kernels in use, all that are there, and what is wrong with them."""
    from kerrcaustics.beams.kernels.library import available_levels, catalogue, level

    try:
        count = len(catalogue()["kernels"])
        return {"level": level(), "levels": [*available_levels()], "count": count, "problem": None}
    except RuntimeError as error:
        return {"level": None, "levels": [], "count": 0, "problem": str(error)}


def _programs() -> dict[str, Any]:
    """The folder of compiled gradients, None if there is none that can be written, and their number and size."""
    from kerrcaustics.beams.program_cache import keep_programs

    folder = keep_programs()
    if folder is None:
        return {"folder": None, "count": 0, "bytes": 0}
    sizes = [file.stat().st_size for file in folder.glob("*-cache")]
    return {"folder": str(folder), "count": len(sizes), "bytes": sum(sizes)}


def _print(entry: dict[str, Any], out: Console) -> None:
    say(out, f"kerrcaustics {entry['version']}, Python {entry['python']}, {entry['platform']}")
    say(out, ", ".join(f"{name} {number}" for name, number in entry["packages"].items()))
    say(out, f"Device: {entry['device']}")
    kernels = entry["kernels"]
    others = [level for level in kernels["levels"] if level != kernels["level"]]
    beside = f" (also there: {', '.join(others)})" if others else ""
    found = f"{kernels['count']} for {kernels['level']}{beside}"
    say(out, f"Kernels: {kernels['problem'] or found}")
    programs = entry["programs"]
    kept = f"{programs['count']} kept in {programs['folder']}, {programs['bytes'] / 1e6:.1f} MB"
    say(out, f"Compiled gradients: {kept if programs['folder'] else 'kept in no folder: none, or none can be written'}")
    say(out, f"OpenGL: {entry['opengl']['advice']}")
    table = PlainTable(("extra", "for", "installed"), words=("extra", "for", "installed"))
    for name, state in entry["extras"].items():
        table.add_row(name, EXTRAS[name], "yes" if state["installed"] else f"no, needs {', '.join(state['missing'])}")
    out.print(table)
    absent = [name for name, state in entry["extras"].items() if not state["installed"] and name not in DEVELOPMENT]
    if absent:
        say(out, f"To add them, in a clone: {Path(sys.executable).name} -m {install(*absent)}")
    else:
        say(out, "Nothing is missing.")
