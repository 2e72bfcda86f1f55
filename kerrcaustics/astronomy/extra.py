"""Optional packages of astronomy, loaded when first needed."""

from importlib import import_module
from typing import Any


def needed(module: str) -> Any:
    """A module of the extra `astro`; an ImportError with the command that installs it if it is missing."""
    try:
        return import_module(module)
    except ImportError:
        package = module.partition(".")[0].replace("_", "-")
        raise ImportError(f'This needs the package {package}: pip install "kerrcaustics[astro]"') from None
