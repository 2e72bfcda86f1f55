"""Optional packages, loaded when first needed; one that is missing is named with the extra that brings it."""

from importlib import import_module
from importlib.util import find_spec
from typing import Any

EXTRAS = {
    "explore": "the explorer in a browser",
    "notebook": "the explorer in notebooks",
    "films": "MP4 films",
    "space": "pictures in three dimensions",
    "sweep": "sweeps over spin, radius and inclination",
    "catalogues": "more stars",
    "exr": "OpenEXR pictures",
    "astro": "FITS, HEALPix and units",
    "inference": "the recipe that infers a spin",
    "test": "the tests",
    "docs": "the documentation",
    "lint": "checks of style and types",
}
"""The purpose of each extra."""

DEVELOPMENT = ("test", "docs", "lint")
"""Extras for work on the package itself."""


def install(*extras: str) -> str:
    """The command that installs extras, in a clone: the package is on no index yet."""
    return f"pip install '.[{','.join(extras)}]'"


def missing(extra: str, *packages: str) -> str:
    """A line about those packages of an extra that are not installed; empty if all are."""
    names = [name.replace("_", "-") for name in packages if find_spec(name) is None]
    if not names:
        return ""
    lacking = f"package {names[0]} is" if len(names) == 1 else f"packages {', '.join(names)} are"
    return f"The {lacking} missing, for {EXTRAS[extra]}: in a clone of kerrcaustics, {install(extra)}"


def require(extra: str, *packages: str) -> None:
    """Raise an ImportError of that line unless the packages of an extra are installed."""
    if line := missing(extra, *packages):
        raise ImportError(line, name=packages[0])


def needed(extra: str, module: str) -> Any:
    """A module of a package of an extra; an ImportError that names the extra if it is missing."""
    require(extra, module.partition(".")[0])
    return import_module(module)
