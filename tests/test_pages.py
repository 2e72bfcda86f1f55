"""README and docs: their code runs, their commands are understood, their links lead somewhere, the pages are built."""

import json
import math
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import run
from exploring import needs_chromium
from offenders import for_each
from pages_in_browser import WIDTHS, copy_buttons, out_of_sight, pages, search_results, too_wide

from kerrcaustics.cli import with_all_commands

app = with_all_commands()
ROOT = Path(__file__).parents[1]
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "packaging").glob("*.md"))]
LESSONS = sorted(path for room in ("fields", "lessons", "recipes") for path in (ROOT / "docs" / room).glob("*.py"))
# What a page takes for granted before its first block.
BEFORE = {
    "results.md": "import numpy as np\nimport kerrcaustics as kc\n"
    "values = np.ones(12 * 64**2)\n"
    "kc.skies.save_sky('sky.fits', kc.skies.celestial_picture(kc.skies.Checkerboard(), 64))\n",
    "sweeps.md": "import numpy as np, xarray\n"
    "axes = {'spin': [0.5, 0.9], 'radius': [3.0, 6.0, 12.0], 'inclination': [60, 90], 'order': [1, 2, 3]}\n"
    "circuits = np.random.default_rng(1).random((2, 3, 2, 3))\n"
    "xarray.Dataset({'circuits': (list(axes), circuits)}, axes).to_zarr('spin_radius.zarr')\n",
    "disks.md": "import kerrcaustics as kc\n",
}


def blocks(page):
    """The Python of a page, block by block."""
    return re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def commands(page):
    """The indented lines of a page that call kerrcaustics, as far as a pipe, a redirection or a comment."""
    lines = re.findall(r"^ {4}(kerrcaustics .*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return [re.split(r"\s+[|#>]", line)[0] for line in lines]


def links(page):
    """The links of a page to other files, with their anchors, as they are read where no page is built."""
    text = re.sub(r"^(`{3,})(?!`|{).*?^\1$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    # Models in space are shown by built pages alone.
    text = re.sub(r"^(`{3,}){only}.*?^\1$", "", text, flags=re.DOTALL | re.MULTILINE)
    found = re.findall(r"\]\(([^)\s]+)\)|(?:href|src)=\"([^\"]+)\"", re.sub(r"`[^`\n]*`", "", text))
    found = [one or other for one, other in found]
    return [link for link in found if not re.match(r"https?:|mailto:", link)]


def anchors(page):
    """The anchors of a page: its headings, as they are on the web."""
    heads = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head).strip().lower().replace(" ", "-") for head in heads}


@for_each(page=PAGES)
def test_links_lead_somewhere(page):
    for link in links(page):
        target, _, anchor = link.partition("#")
        file = (page.parent / target).resolve() if target else page
        assert file.is_relative_to(ROOT) and file.exists(), link
        assert not anchor or anchor in anchors(file), link


def test_links_are_found():
    assert sum(len(links(page)) for page in PAGES) > 100


def test_each_statement_of_the_paper_has_a_test():
    page = (ROOT / "docs" / "figures_of_the_paper.md").read_text(encoding="utf-8")
    table = page.partition("## What the paper states")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (?!JTFT)(.*) \|$", table, re.MULTILINE)
    assert len(rows) > 15
    here = (ROOT / "tests" / "test_paper_statements.py").read_text(encoding="utf-8")
    for row in rows:
        named = re.findall(r"`(tests/\w+\.py|test_\w+)`", row.rpartition(" | ")[2])
        assert named, row
        for name in named:
            assert (ROOT / name).exists() if "/" in name else f"def {name}(" in here, name


def test_films_and_models_of_pages_are_there_and_small():
    clips = {path.name: path.stat().st_size for path in (ROOT / "docs" / "clips").iterdir()}
    assert max(clips.values()) < 4e5 and sum(clips.values()) < 3e6
    text = "".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs").glob("*.md"))
    assert {Path(name).name for name in re.findall(r'<video[^>]* src="clips/([^"]+)"', text)} == set(clips)
    models = re.findall(r'<iframe[^>]* src="models/(\w+)\.html"', text)
    assert models and all((ROOT / "figures" / f"{name}.py").exists() for name in models)
    # In words for who does not see them, and not played to who did not ask for it.
    videos = re.findall(r"<video[^>]*>", text)
    assert all(" controls " in video and "aria-label=" in video and "autoplay" not in video for video in videos)
    assert text.count("```{figure}") == len(re.findall(r"```\{figure\}[^\n]*\n:alt: \w", text)) > 0


def test_every_module_is_listed_with_a_sentence():
    done = subprocess.run(
        [sys.executable, ROOT / "docs" / "module_list.py"], capture_output=True, text=True, check=True
    )
    listed = re.findall(r"^(?:- `\S+`:|\*\*`\S+`\*\*) (.{10,})$", done.stdout, re.MULTILINE)
    assert len(listed) == len(list((ROOT / "kerrcaustics").rglob("*.py")))
    assert "<!-- modules -->" in (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


@for_each(page=[page for page in PAGES if commands(page)])
def test_commands_are_understood(page, monkeypatch):
    for line in commands(page):
        words = shlex.split(line)[1:]
        if not {"NAME", "COMMAND", "..."} & set(words) and "--help" not in words:
            app.parse_args(words, exit_on_error=False, print_error=False)


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page)], ids=lambda page: page.name)
def test_code_runs(page, tmp_path):
    """In the order of the page, in a process and a folder of its own."""
    begin = "import matplotlib; matplotlib.use('Agg')\n"
    code = "\n".join([begin, BEFORE.get(page.name, ""), *blocks(page)])
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]


def rows_of_limits():
    """The last cells of the tables of the page, by section: a command, or one expression of Python."""
    page = (ROOT / "docs" / "limits.md").read_text(encoding="utf-8")
    for section in page.split("\n## ")[1:]:
        for cell in re.findall(r"\| ((?:in Python: )?`[^`]+`) \|$", section, re.MULTILINE):
            yield section.partition("\n")[0], cell.replace("`", "")


def test_rows_of_limits_are_found():
    rows = list(rows_of_limits())
    table_lines = (ROOT / "docs" / "limits.md").read_text(encoding="utf-8").count("\n|")
    assert len(rows) == table_lines - 2 * len({section for section, _ in rows}) > 20


@pytest.mark.slow
@pytest.mark.parametrize(("section", "shown"), list(rows_of_limits()))
def test_what_limits_say_is_so(section, shown, capsys):
    refused = section == "Where it refuses"
    if shown.startswith("in Python: "):
        import kerrcaustics as kc

        names = {"kc": kc, "math": math, "camera": kc.Camera(0.9, 10.0), "star": (1.4, 2.9)}
        with pytest.raises(ValueError, match="Argument"):
            eval(shown.removeprefix("in Python: "), names)
        assert refused
        return
    status, out, error = run(capsys, *shlex.split(shown)[1:])
    in_doubt = section == "Where it says that it does not know" and " images " in shown
    assert status == (2 if refused else 1 if in_doubt else 0), error
    if refused:
        assert not out and error.count("\n") == 1 and "Argument" in error


@pytest.mark.slow
@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.stem)
def test_a_lesson_is_a_notebook_that_runs(lesson):
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    gallery = pytest.importorskip("sphinx_gallery.gen_gallery")
    from sphinx_gallery.notebook import jupyter_notebook
    from sphinx_gallery.py_source_parser import split_code_and_text_blocks

    _, parts = split_code_and_text_blocks(str(lesson))
    made = jupyter_notebook(parts, gallery.DEFAULT_GALLERY_CONF, str(lesson.parent))
    book = nbformat.reads(json.dumps(made), as_version=4)
    assert not any(cell.get("outputs") for cell in book.cells)
    # A guard against what hangs, wide enough for a busy machine.
    nbclient.NotebookClient(book, timeout=3600, kernel_name="python3").execute()


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The pages without figures, built with warnings as errors."""
    pytest.importorskip("sphinx")
    folder = tmp_path_factory.mktemp("site")
    call = [sys.executable, "-m", "sphinx", "-q", "-W", "-E", "-b", "html", "-d", folder / "trees"]
    quick = {**os.environ, "KERRCAUSTICS_DOCS": "quick"}
    done = subprocess.run([*call, ROOT / "docs", folder / "html"], env=quick, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return folder / "html"


@pytest.mark.slow
def test_reference_and_commands_are_complete(site):
    text = (site / "api.html").read_text(encoding="utf-8")
    assert str(ROOT) not in text and "&lt;module" not in text
    assert "critical_curves.py" in (site / "architecture.html").read_text(encoding="utf-8").partition("The modules")[2]
    listed = {
        "plots": "DiffractionPattern",
        "results": "light-curve/2",
        "sweeps": "map_rows",
        "films": "hot_spots_kerr",
    }
    assert all(word in (site / f"{name}.html").read_text(encoding="utf-8") for name, word in listed.items())
    keys = (site / "scene_files.html").read_text(encoding="utf-8").partition("The tables")[2]
    assert "retrograde-plunging" in keys and "[camera.path]" in keys and "&lt;!--" not in keys
    reported = (site / "commands.html").read_text(encoding="utf-8")
    names = [name for name in app if not name.startswith("-")]
    assert len(names) > 10 and all(f'id="cyclopts-kerrcaustics-{name}"' in reported for name in names)


@pytest.mark.slow
def test_a_page_that_is_too_wide_is_noticed(tmp_path):
    needs_chromium()
    wide = "<div style='width: 1000px; height: 1px'></div>"
    for name, style in (("boxed", "overflow-x: auto"), ("open", "")):
        (tmp_path / f"{name}.html").write_text(f"<!DOCTYPE html><article><div style='{style}'>{wide}</div></article>")
    assert [line.partition(":")[0] for line in too_wide(tmp_path)] == [f"open.html at {w}" for w in WIDTHS[:3]]


@pytest.mark.slow
def test_no_page_is_wider_than_its_window(site):
    needs_chromium()
    assert len(pages(site)) > 60 and too_wide(site) == []


@pytest.mark.slow
def test_a_phone_shows_the_commands_of_limits(site):
    needs_chromium()
    count, hidden = out_of_sight(site / "limits.html", "td:last-child code", 390)
    assert count > 20 and hidden == []


@pytest.mark.slow
def test_blocks_of_code_have_a_button_that_is_read_in_light_and_dark(site):
    needs_chromium()
    for name in ("install", "index", "howto/how_3_gradients"):
        contrasts, blocks_of_page = copy_buttons(site / f"{name}.html")
        assert blocks_of_page == len(contrasts["light"]) == len(contrasts["dark"]) > 0, name
        assert min(min(each) for each in contrasts.values()) > 4.5, contrasts


@pytest.mark.slow
@pytest.mark.parametrize(
    ("word", "first"),
    [
        ("video", "films"),
        ("jit", "howto/how_3_gradients"),
        ("gradient", "howto/how_3_gradients"),
        ("exposure", "howto/how_1_exposure"),
        ("360°", "howto/how_2_panorama"),
        ("360", "howto/how_2_panorama"),
        ("photo", "howto/how_2_panorama"),
        ("microlensing", "your_field"),
    ],
)
def test_search_answers_with_the_page_that_says(site, word, first):
    needs_chromium()
    assert search_results(site, word)[0] == f"{first}.html"
