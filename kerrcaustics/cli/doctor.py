"""The command `doctor`: the state of the installation, and advice about missing parts."""

import os
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
from kerrcaustics.extras import EXTRAS


@app.command(**with_examples("doctor"))
def doctor(*, common: CommonOptions = COMMON) -> None:
    """List what is installed and what is missing: extras, device, cache of compiled programs, OpenGL."""
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
        "cache": _cache(),
    }
    common.write(entry)
    _print(entry, common.console())


def _device() -> str:
    """The device that computes, in words."""
    import jax

    first = jax.devices()[0]
    cores = f", {len(os.sched_getaffinity(0))} cores" if hasattr(os, "sched_getaffinity") else ""
    return f"{first.device_kind}{cores}" if first.platform == "cpu" else f"{first.platform}: {first.device_kind}"


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


def _cache() -> dict[str, Any]:
    """The folder of compiled programs: path, number and size of files, whether it can be written, and why not."""
    from kerrcaustics.beams.compile_cache import KEPT, cache_folder, unsafe_cache

    folder, unsafe = cache_folder(), unsafe_cache()
    if folder is None:
        return {"folder": None, "programs": 0, "bytes": 0, "writable": False, "unsafe": "there is no home folder"}
    readable = not unsafe and os.access(folder, os.R_OK | os.X_OK)
    files = [path.stat().st_size for path in folder.iterdir() if KEPT.fullmatch(path.name)] if readable else []
    home = next((place for place in (folder, *folder.parents) if place.exists()), Path("/"))
    writable = not unsafe and os.access(home, os.W_OK)
    sizes = {"programs": len(files), "bytes": sum(files)}
    return {"folder": str(folder), **sizes, "writable": writable, "unsafe": unsafe or None}


def _print(entry: dict[str, Any], out: Console) -> None:
    say(out, f"kerrcaustics {entry['version']}, Python {entry['python']}, {entry['platform']}")
    say(out, ", ".join(f"{name} {number}" for name, number in entry["packages"].items()))
    say(out, f"Device: {entry['device']}")
    cache = entry["cache"]
    content = f"{cache['programs']} compiled programs, {cache['bytes'] / 1e6:.0f} MB"
    if cache["unsafe"]:
        mend = "programs are compiled at every start (fix this, or set XDG_CACHE_HOME to a folder of your own)"
        say(out, f"Cache: {cache['folder'] or 'none'}: not used, as {cache['unsafe']}: {mend}")
    else:
        unkept = "" if cache["writable"] else "; it is not writable: missing programs are compiled again at every start"
        say(out, f"Cache: {cache['folder']}: {content}{unkept}")
    say(out, f"OpenGL: {entry['opengl']['advice']}")
    table = PlainTable(("extra", "for", "installed"), words=("extra", "for", "installed"))
    for name, state in entry["extras"].items():
        table.add_row(name, EXTRAS[name], "yes" if state["installed"] else f"no, needs {', '.join(state['missing'])}")
    out.print(table)
    absent = [name for name, state in entry["extras"].items() if not state["installed"]]
    if absent:
        say(out, f"To add them: {Path(sys.executable).name} -m pip install 'kerrcaustics[{','.join(absent)}]'")
    else:
        say(out, "Nothing is missing.")
