"""The figures of a checkout: the form of their scripts, and the command that runs them."""

import ast
import inspect
import re
from pathlib import Path

import pytest
from command_line import run
from offenders import for_each

from kerrcaustics.scene_files.templates import film_templates
from kerrcaustics.scripts import FIGURES, FILMS, ScriptFolder, figures_folder, scripts_home

SCRIPT = """
def main(output):
    path = output / "{name}.png"
    path.write_text("{name}")
    return [path]
"""


@pytest.fixture
def made_up(tmp_path, scripts_at):
    """A folder of three scripts, one of which fails, and of one that is none."""
    folder = tmp_path / "figures"
    folder.mkdir()
    for name in ("apples", "pears"):
        (folder / f"{name}.py").write_text(SCRIPT.format(name=name))
    (folder / "worms.py").write_text("def main(output):\n    raise ValueError('found\\nworms')\n")
    (folder / "_stones.py").write_text("def main(output):\n    return []\n")
    scripts_at("FIGURES", folder)
    return folder


def test_pages_list_the_figures_of_the_paper_and_the_films(monkeypatch):
    docs = Path(__file__).parents[1] / "docs"
    monkeypatch.syspath_prepend(docs)
    from figure_list import film_list, paper_figures

    rows = re.findall(
        r"^\| (A?\d+) \| \[.+\]\(gallery/(\w+)\.rst\) \| .{9,} \| .{8,} \|$", paper_figures(), re.MULTILINE
    )
    assert {number for number, _ in rows} == {*map(str, range(1, 17)), "A1"}
    assert len(rows) == 18 and {name for _, name in rows} <= set(FIGURES.names())
    films = re.findall(r"^\| `(\w+)` \| .{30,} \|$", film_list(), re.MULTILINE)
    assert sorted(films) == sorted([*FILMS.names(), *film_templates()])
    for page, mark in (("figures_of_the_paper", "figures"), ("films", "films")):
        assert f"<!-- {mark} -->" in (docs / f"{page}.md").read_text(encoding="utf-8")


@for_each(name=FIGURES.names())
def test_script_has_the_form_of_a_figure(name):
    tree = ast.parse((FIGURES.folder / f"{name}.py").read_text(encoding="utf-8"))
    title, underline, blank, text = inspect.cleandoc(ast.get_docstring(tree) or "\n\n\n").splitlines()[:4]
    assert title and len(underline) >= len(title) and set(underline) == {"="} and not blank and text
    assert isinstance(tree.body[-1], ast.If), "no `if __name__ == ...` at the end"


@pytest.mark.slow
@pytest.mark.parametrize("name", FIGURES.names())
def test_script_makes_its_files(name, tmp_path):
    files = FIGURES.run(name, tmp_path)
    assert files and {file.name for file in files} == {path.name for path in tmp_path.iterdir()}
    for file in files:
        start = {".png": b"\x89PNG\r\n\x1a\n", ".pdf": b"%PDF-"}.get(file.suffix, b"")
        assert file.read_bytes().startswith(start) and file.stat().st_size > 1000


def test_command_makes_what_is_named_once(made_up, tmp_path, capsys):
    status, out, err = run(capsys, "figures", "pears", "pears", "--output", tmp_path / "new")
    assert (status, err) == (0, "") and out.count(str(tmp_path / "new" / "pears.png")) == 1
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["pears.png"]


def test_a_figure_that_fails_does_not_stop_the_others(made_up, capsys):
    status, out, err = run(capsys, "figures")
    assert status == 1 and "figure worms: ValueError: found worms" in err and "1 of 3" in err and err.count("\n") == 2
    assert {path.name for path in (made_up / "out").iterdir()} == {"apples.png", "pears.png"}
    assert out.count(".png") == 2


@pytest.mark.parametrize("name", ["_stones", "plums", "../pears"])
def test_what_is_no_figure_is_one_line_and_status_2(made_up, capsys, name):
    status, out, err = run(capsys, "figures", "pears", name)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert "apples, pears, worms" in err and name in err
    assert not (made_up / "out").exists()


def test_without_a_checkout_figures_are_refused(tmp_path, scripts_at, assert_refused):
    scripts_at("FIGURES", tmp_path / "figures")
    assert_refused(["figures"], "checkout")


def test_scripts_of_an_installed_package_are_its_own_and_write_nothing_into_it(tmp_path):
    package = tmp_path / "kerrcaustics"
    home = scripts_home(package)
    assert home.is_relative_to(package)
    assert not figures_folder(ScriptFolder("figure", home / "figures")).is_absolute()
    (tmp_path / "pyproject.toml").touch()
    assert scripts_home(package) == tmp_path
    assert figures_folder(ScriptFolder("figure", tmp_path / "figures")) == tmp_path / "figures" / "out"
