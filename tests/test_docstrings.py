"""Docstrings of the public names: their sections, and examples that run."""

import doctest
import inspect
import re

import pytest
from offenders import for_each
from public import PUBLIC

import kerrcaustics as kc
from kerrcaustics.results.declared import LAYOUTS

NAMES = list(PUBLIC)
FUNCTIONS = [name for name in NAMES if not inspect.isclass(PUBLIC[name])]
# Classes that users make; the others are what functions return.
MADE = {kc.pictures.View, kc.Camera, kc.Observer}
CLASSES = [name for name in NAMES if name not in FUNCTIONS]
CLASSES = [name for name in CLASSES if PUBLIC[name] not in {*LAYOUTS, kc.Status} or PUBLIC[name] in MADE]
# They check nothing that they are given.
NEVER_RAISE = {"hipparcos", "show"}


def sections(name):
    """The titles of a docstring, in their order."""
    return re.findall(r"^(\w+)\n-{3,}$", inspect.getdoc(PUBLIC[name]), re.MULTILINE)


@for_each(name=FUNCTIONS + CLASSES)
def test_sections(name):
    found = sections(name)
    assert "Examples" in found
    assert "Parameters" in found or not inspect.signature(PUBLIC[name]).parameters
    assert "Raises" in found or name in NEVER_RAISE


def test_sections_come_once_and_in_order():
    order = ["Parameters", "Attributes", "Returns", "Raises", "Errors", "Notes", "References", "Examples"]
    found = {name: sections(name) for name in NAMES}
    assert found == {name: [title for title in order if title in titles] for name, titles in found.items()}


def test_no_private_name_is_cited():
    cited = {name: re.findall(r"`(_\w+)`", inspect.getdoc(PUBLIC[name])) for name in NAMES}
    assert {name: private for name, private in cited.items() if private} == {}


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in NAMES if "Examples" in sections(name)])
def test_examples_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    runner = doctest.DocTestRunner()
    for test in doctest.DocTestFinder(recurse=False).find(inspect.unwrap(PUBLIC[name]), name):
        runner.run(test)
    assert runner.summarize().failed == 0
