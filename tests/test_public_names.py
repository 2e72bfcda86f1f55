"""The public names: each is loaded when it is used, and the reference names no other."""

import re
from importlib import import_module
from inspect import signature
from pathlib import Path

import pytest

import kerrcaustics as kc
from kerrcaustics import cli

REFERENCE = (Path(__file__).parents[1] / "docs" / "api.md").read_text(encoding="utf-8")
DESCRIBED = re.findall(r"auto(?:class|function):: ([\w.]+)", REFERENCE)


@pytest.mark.parametrize("name", kc.__all__)
def test_name_is_loaded_and_described(name):
    assert getattr(kc, name).__name__.rpartition(".")[2] == name
    assert any(name in described.split(".") for described in DESCRIBED) and name in dir(kc)


@pytest.mark.parametrize("name", sorted(set(DESCRIBED) - set(kc.__all__)))
def test_reference_gives_other_names_their_module(name):
    module, _, last = name.rpartition(".")
    assert hasattr(import_module(module), last)


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nothing"):
        _ = kc.nothing


def test_highest_index_is_the_same_everywhere():
    functions = [getattr(kc, name) for name in kc.__all__ if name[0].islower() and callable(getattr(kc, name))]
    functions += [cli.images.images, cli.counts.counts, cli.tracks.tracks]
    defaults = {
        f: signature(f).parameters["max_index"].default for f in functions if "max_index" in signature(f).parameters
    }
    assert len(defaults) >= 10 and set(defaults.values()) == {2}
