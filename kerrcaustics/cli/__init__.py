"""The command line. Degrees in and out; a command's module is loaded when it is called, and heavy ones inside it."""

import sys
from importlib import import_module
from typing import Any

import cyclopts

from kerrcaustics.cli.app import app, main as _run
from kerrcaustics.cli.endings import BadInput as BadInput

# The commands, and the modules that hold them.
_MODULES = {
    name: {"demo": "caustics", "light-curve": "light_curve"}.get(name, name)
    for name in (
        *("amplification", "caustics", "check", "counts", "demo", "doctor", "explore", "figures", "film", "images"),
        *("light-curve", "magnification", "render", "rings", "scale", "scene", "study", "sweep", "tracks"),
    )
}


def main() -> None:
    """Run the command line, of which only the command that is called is loaded, and exit."""
    named = next((word for word in sys.argv[1:] if not word.startswith("-")), "")
    if named in _MODULES:
        import_module(f"{__name__}.{_MODULES[named]}")
    else:
        with_all_commands()
    _run()


def with_all_commands() -> cyclopts.App:
    """The program with all its commands."""
    for module in _MODULES.values():
        import_module(f"{__name__}.{module}")
    return app


def __getattr__(name: str) -> Any:
    """The module of a command."""
    if name in _MODULES.values():
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__} has no attribute {name}")
