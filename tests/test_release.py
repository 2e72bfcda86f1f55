"""Facts of a release that stand in several files agree."""

import json
import re
import subprocess
import tomllib
from importlib.util import module_from_spec, spec_from_file_location
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


def test_the_build_needs_packages_of_the_project_in_its_versions():
    pyproject = tomllib.loads(text("pyproject.toml"))
    needed = pyproject["build-system"]["requires"]
    assert set(needed) <= {*PROJECT["dependencies"], *pyproject["dependency-groups"]["build"]}
    host = text("packaging/conda/recipe.yaml").split("  host:\n")[1].split("  run:\n")[0]
    there = {line.strip(" -").replace(" ", "") for line in host.splitlines()}
    # conda has a compiler of its own.
    assert there - {"python", "pip"} == {one for one in needed if not one.startswith("ziglang")}


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


@pytest.mark.parametrize("name", ["pip", "setuptools"])
def test_the_lock_holds_what_installs(name, tmp_path):
    """With hashes; the Makefile takes just these lines for its first step."""
    lines = re.search(
        rf"^{name}==[\w.]+ \\\n(?:    --hash=sha256:[0-9a-f]{{64}}(?: \\)?\n)+", text("requirements.lock"), re.M
    )
    script = re.search(r"\t@(sed .* requirements.lock) >", text("Makefile"))[1].replace("$$", "$")
    taken = subprocess.run(script, shell=True, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert lines[0] in taken and re.findall(r"^(\w+)==", taken, re.M) == ["pip", "setuptools"]


def test_gpl_libraries_in_wheels_are_named():
    av = pytest.importorskip("av", reason="av is missing: pip install '.[films]'")
    libraries = {path.name.split("-")[0].removeprefix("lib") for path in Path(av.__file__).parents[1].glob("av.libs/*")}
    said = text("docs/install.md").partition("### GPL software")[2].partition("\n## ")[0]
    assert all(f"**{name}**" in said for name in {"x264", "x265", "xvidcore", "postproc"} & libraries)
    assert "films" in text("README.md").partition("MIT licence.")[2] and "under the GPL" in said


def test_workflows_try_every_python_that_is_promised():
    promised = re.findall(r"Programming Language :: Python :: (3\.\d+)", text("pyproject.toml"))
    tried = re.search(r"^        python: \[(.*)\]$", text(".github/workflows/tests.yml"), re.M)[1]
    assert re.findall(r"3\.\d+", tried) == promised


def test_the_paper_cites_what_is_in_its_references():
    cited = set(re.findall(r"@(\w+)", text("docs/paper/paper.md")))
    listed = set(re.findall(r"^@\w+\{(\w+),", text("docs/paper/paper.bib"), re.M))
    assert cited == listed


def test_links_of_the_readme_lead_to_the_repository_from_an_index():
    """Also pictures; what leads elsewhere already is left alone, and without an address everything is."""
    found = spec_from_file_location("hatch_readme", ROOT / "packaging" / "hatch_readme.py")
    hook = module_from_spec(found)
    pytest.importorskip("hatchling", reason="hatchling is missing: make setup")
    found.loader.exec_module(hook)
    readme = text("README.md") + "\n![a](docs/a.png) [b](#limits) [c](https://c.org/c)\n"
    assert hook.index_page(readme, None, "1.2.3") == readme
    page = hook.index_page(readme, "https://example.org/kerr/", "1.2.3")
    relative = r'(?:\]\(|(?:src|href)=")(?!https?:|mailto:|#)'
    assert re.search(relative, readme) and not re.search(relative, page)
    assert 'src="https://example.org/kerr/raw/v1.2.3/docs/images/scene_file.png"' in page
    assert "(https://example.org/kerr/blob/v1.2.3/docs/limits.md)" in page
    assert page.endswith("![a](https://example.org/kerr/raw/v1.2.3/docs/a.png) [b](#limits) [c](https://c.org/c)\n")
