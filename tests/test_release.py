"""What a release says of itself in several files is one thing."""

import json
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def text(name):
    return (ROOT / name).read_text(encoding="utf-8")


def test_every_file_names_the_same_version():
    said = {
        "CITATION.cff": re.search(r"^version: (.*)$", text("CITATION.cff"), re.M)[1],
        "codemeta.json": json.loads(text("codemeta.json"))["version"],
        "recipe.yaml": re.search(r'^  version: "(.*)"$', text("packaging/conda/recipe.yaml"), re.M)[1],
        "CHANGELOG.md": re.search(r"^## (\S+)", text("CHANGELOG.md"), re.M)[1],
    }
    assert said == dict.fromkeys(said, PROJECT["version"])


def test_dates_of_the_release_agree():
    cited = re.search(r'^date-released: "(.*)"$', text("CITATION.cff"), re.M)[1]
    assert re.search(r"^## \S+ \((.*)\)", text("CHANGELOG.md"), re.M)[1] in (cited, "unreleased")
    assert json.loads(text("codemeta.json"))["dateModified"] == cited


def test_the_conda_recipe_needs_what_the_project_needs():
    run = text("packaging/conda/recipe.yaml").split("  run:\n")[1].split("\n\n")[0]
    needed = [line.strip(" -").replace(" ", "").replace("matplotlib-base", "matplotlib") for line in run.splitlines()]
    assert needed[1:] == PROJECT["dependencies"]


def test_every_extra_is_tried_in_a_clean_environment():
    tried = re.search(r"^extras=\((.*)\)$", text("packaging/check.sh"), re.M)[1].split()
    assert sorted(tried) == sorted(set(PROJECT["optional-dependencies"]) - {"test", "docs", "lint"})


@pytest.mark.parametrize("extra", [None, *sorted(set(PROJECT["optional-dependencies"]) - {"docs", "lint"})])
def test_the_oldest_lock_holds_the_lower_bounds(extra):
    wanted = PROJECT["dependencies"] if extra is None else PROJECT["optional-dependencies"][extra]
    locked = dict(re.findall(r"^([\w.-]+?)(?:\[.*\])?==([\w.]+)", text("requirements-oldest.lock"), re.M))
    for one in wanted:
        name, bound = re.match(r"([\w-]+)(?:\[.*\])?>=(.*)", one).groups()
        if name != "numpy":
            assert locked[name.lower()].startswith(bound.removesuffix(".0")), one
