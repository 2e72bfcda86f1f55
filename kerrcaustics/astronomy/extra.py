"""Packages of astronomers: loaded when first needed, and told by name where they are missing."""

from importlib import import_module
from typing import Any


def needed(module: str) -> Any:
    """A module of the extra `astro`, or an ImportError that tells how to get it."""
    try:
        return import_module(module)
    except ImportError:
        package = module.partition(".")[0].replace("_", "-")
        raise ImportError(f'This needs the package {package}: pip install "kerrcaustics[astro]"') from None
