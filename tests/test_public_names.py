"""The public names: each is loaded when it is used, and the reference names no other."""

import inspect
import re
from importlib import import_module
from inspect import signature
from pathlib import Path

import pytest
from offenders import for_each
from public import PUBLIC, SPACES

import kerrcaustics as kc
from kerrcaustics import cli

REFERENCE = (Path(__file__).parents[1] / "docs" / "api.md").read_text(encoding="utf-8")
DESCRIBED = re.findall(r"auto(?:class|function):: ([\w.]+)", REFERENCE)


NAMES = [(space, name) for space in SPACES for name in space.__all__]


@for_each("space", "name", rows=NAMES)
def test_name_is_loaded_and_described(space, name):
    assert getattr(space, name).__name__.rpartition(".")[2] == name
    described = name if space is kc else f"{space.__name__}.{name}"
    assert name in dir(space)
    # A name that stands at the top too is described there.
    twin = getattr(kc, name) if space is not kc and name in kc.__all__ else None
    assert described in DESCRIBED or inspect.ismodule(getattr(space, name)) or twin is getattr(space, name)


def test_few_names_stand_at_the_top():
    assert len(kc.__all__) <= 56


@for_each(name=sorted(set(DESCRIBED) - set(PUBLIC)))
def test_reference_gives_other_names_their_module(name):
    module, _, last = name.rpartition(".")
    assert hasattr(import_module(module), last)


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nothing"):
        _ = kc.nothing


def test_highest_index_is_the_same_everywhere():
    functions = [one for name, one in PUBLIC.items() if name[0].islower() and callable(one)]
    functions += [cli.images.images, cli.counts.counts, cli.tracks.tracks]
    defaults = {
        f: signature(f).parameters["max_index"].default for f in functions if "max_index" in signature(f).parameters
    }
    # A spot has none: what is left out is 2 for a point and a ball, and nothing for a spot.
    assert defaults.pop(kc.light_curve) is None
    assert len(defaults) >= 10 and set(defaults.values()) == {2}
