"""The report of studies: one page that holds all of them, says what is missing, and is never half-written."""

import base64
import io
import json
import re
from html.parser import HTMLParser

import pytest
from command_line import run
from PIL import Image

from kerrcaustics import __version__
from kerrcaustics.report.tables import markdown_table, read_tables
from kerrcaustics.scripts import STUDIES

MACHINE = {"processor": "Slow & <steady>", "cores": 2, "jax": "0.6"}
HEADS, ROWS = ["engine", "µs", "verdict"], [["auto", "4.2", "ok"], ["a < b & c", "", "FAIL"]]
PROBLEMS = [
    {"engine": "auto", "group": "spin", "problem": "a = 0", "verdict": "honest", "faults": []},
    {"engine": "auto", "group": "spin", "problem": "a < 1", "verdict": "FAIL", "faults": ["index 2", "n' <10>"]},
    {"engine": "integrated", "group": "spin", "problem": "a = 0", "verdict": "ok", "faults": []},
]


def picture(grey):
    file = io.BytesIO()
    Image.new("L", (30, 12), grey).save(file, "png")
    return file.getvalue()


def leave(folder, name, grey=0, table=True, **content):
    """The files that a study leaves in a folder."""
    folder.mkdir(exist_ok=True)
    entry = {"schema": f"kerrcaustics/study/{name}/1", "version": __version__, "machine": MACHINE}
    entry |= {"date": "2026-11-20T08:00:00+00:00", "about": ""} | content
    (folder / f"{name}.json").write_text(json.dumps(entry))
    (folder / f"{name}.png").write_bytes(picture(grey))
    (folder / f"{name}.md").write_text(f"**{name} <table>**\n\n{markdown_table(HEADS, ROWS)}" if table else "Nothing.")
    return folder


@pytest.fixture
def records(tmp_path, monkeypatch):
    """A folder with records of three studies, which is the current one."""
    monkeypatch.chdir(tmp_path)
    about = "Where? <there>\n\n    python x.py\n\nIn words. Writes stability.json and\nmore.\n\n- one\n- two"
    dates = {"date": "2026-11-21T22:10:00+00:00", "seconds": 83.0}
    leave(tmp_path / "study-stability", "stability", 80, problems=PROBLEMS, about=about, **dates)
    leave(tmp_path / "study-cost", "cost", 160, findings=["A ray < 2 µs & less."], settings={"many": list(range(9))})
    leave(tmp_path, "accuracy", 240)
    (tmp_path / "notes.json").write_text('{"schema": "notes/1"}')
    (tmp_path / "broken.json").write_text("{")
    return tmp_path


class Page(HTMLParser):
    """Text of the page, its tags, and the rows of its tables."""

    def __init__(self, text):
        super().__init__()
        self.text, self.tags, self.rows, self.open = "", [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.open += [tag] if tag not in ("meta", "img") else []
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "style" in self.open:
            return
        self.text += data
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data


def page_of(capsys, *arguments):
    status, out, err = run(capsys, "study", "report", *arguments)
    assert (status, err) == (0, "") and "report.html" in out
    return Page(text := open("report.html", encoding="utf-8").read()), text, out


def test_page_is_whole_and_loads_nothing(capsys, records):
    page, text, _ = page_of(capsys)
    places = [value for _, attrs in page.tags for key, value in attrs.items() if key in ("src", "href", "srcset")]
    assert len(places) == 6 and all(place.startswith(("data:image/png;base64,", "#")) for place in places)
    assert not re.search(r"https?:|url\(|@import|<script|@[A-Z]+@", text)
    pictures = [base64.b64decode(place.split(",")[1]) for place in places if place.startswith("data:")]
    # Error against run time and stability come first.
    assert pictures == [picture(240), picture(80), picture(160)]
    assert all(attrs["alt"] for tag, attrs in page.tags if tag == "img")
    assert page.rows.count(HEADS) == 3 and all(page.rows.count(row) == 3 for row in ROWS)
    assert "stability <table>" in page.text and "A ray < 2 µs & less." in page.text
    assert "Slow & <steady>" in page.text and "9 values from 0 to 8" in page.text


def test_study_speaks_for_itself_without_its_usage(capsys, records):
    page, _, _ = page_of(capsys)
    for words in ("Where? <there>", "In words.", "• one", "• two", "2026-11-21", "1\u00a0min\u00a023\u00a0s"):
        assert words in page.text
    assert "python x.py" not in page.text and "Writes" not in page.text


def test_verdicts_are_counted_and_faults_listed(capsys, records):
    page, _, _ = page_of(capsys)
    counts = page.rows[page.rows.index(["engine", "ok", "honest", "FAIL"]) :][1:3]
    assert counts == [["auto", "0", "1", "1"], ["integrated", "1", "0", "0"]]
    assert ["spin: a < 1", "auto", "FAIL", "index 2; n' <10>"] in page.rows


def test_all_problems_are_listed_with_their_numbers_in_the_order_of_the_record(capsys, records):
    shown = [row | {"shown": {"rays": str(k)}} for k, row in enumerate(PROBLEMS)]
    leave(records / "study-stability", "stability", 80, problems=shown)
    page, _, _ = page_of(capsys)
    at = page.rows.index(["problem", "engine", "rays", "verdict"])
    assert "All 3 rows of problems by engine" in page.text
    assert [row[2] for row in page.rows[at + 1 : at + 4]] == ["0", "1", "2"]
    assert page.rows[at + 2] == ["spin: a < 1", "auto", "1", "FAIL"]


def test_missing_studies_other_versions_and_machines_are_reported(capsys, records):
    page, _, out = page_of(capsys)
    others = [name for name in STUDIES.names() if name not in ("accuracy", "cost", "stability")]
    assert others and all(f"kerrcaustics study {name}" in page.text and name in out for name in others)
    assert "kerrcaustics study cost" not in page.text and "another version" not in page.text
    leave(records / "study-cost", "cost", version="0.0.7", machine={"processor": "fast"})
    page, _, _ = page_of(capsys)
    assert f"by version 0.0.7, not {__version__}" in page.text and "2 different machines" in page.text
    assert page.text.count("on machine B") == 1


def test_same_records_make_the_same_page_without_a_checkout_too(capsys, records, scripts_at):
    _, text, _ = page_of(capsys)
    assert page_of(capsys)[1] == text
    scripts_at("STUDIES", records / "studies")
    assert "without a checkout" in page_of(capsys)[0].text
    status, _, err = run(capsys, "study", "report", "--run")
    assert status == 2 and "checkout" in err and err.count("\n") == 1


DAMAGES = {
    "cut off": (
        lambda f: (f / "cost.json").write_text('{"schema": "kerrcaustics/study/cost/1", "ver'),
        "no whole JSON",
    ),
    "empty": (lambda f: (f / "cost.json").write_text(""), "no whole JSON"),
    "a list": (lambda f: (f / "cost.json").write_text("[1]"), "no schema"),
    "later schema": (lambda f: leave(f, "cost", schema="kerrcaustics/study/cost/2"), "no schema"),
    "no machine": (lambda f: leave(f, "cost", machine=None), "'machine'"),
    "no date": (lambda f: leave(f, "cost", date=None), "'date'"),
    "another date": (lambda f: leave(f, "cost", date="yesterday"), "'date'"),
    "problem": (lambda f: leave(f, "cost", problems=[{"engine": "auto"}]), "verdict"),
    "no picture": (lambda f: (f / "cost.png").unlink(), "cost.png is missing"),
    "half a picture": (lambda f: (f / "cost.png").write_bytes(picture(0)[:-9]), "no whole PNG"),
    "no tables": (lambda f: (f / "cost.md").unlink(), "cost.md is missing"),
    "half a table": (
        lambda f: (f / "cost.md").write_text("| a | b |\n| --- | ---: |\n| 1 |"),
        "'| a | b |' is not whole",
    ),
    "twice": (lambda f: leave(f.parent / "other", "cost"), "other/cost.json"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_record_is_one_line_and_nothing_is_written(damage, capsys, records):
    spoil, words = DAMAGES[damage]
    spoil(records / "study-cost")
    before = sorted(path.name for path in records.iterdir())
    status, out, err = run(capsys, "study", "report")
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert "FOLDER must hold" in err and words in err
    assert sorted(path.name for path in records.iterdir()) == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nowhere",), "FOLDER must be a folder that exists, but is nowhere"),
        (("empty",), "FOLDER must hold records of studies, but empty has none"),
        (("--output", "none/report.html"), "--output must name a file in a folder that exists"),
    ],
)
def test_bad_arguments_are_one_line(arguments, words, capsys, records):
    (records / "empty").mkdir()
    status, out, err = run(capsys, "study", "report", *arguments)
    assert (status, out) == (2, "") and err.count("\n") == 1 and words in err
    assert not (records / "report.html").exists()


def test_page_takes_its_name_when_it_is_complete(capsys, records, monkeypatch):
    (records / "report.html").write_text("old")
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError("no room")))
    assert run(capsys, "study", "report")[0] == 1
    assert (records / "report.html").read_text() == "old" and not list(records.glob(".report*"))


def test_no_study_is_called_like_the_command():
    assert "report" not in STUDIES.names()


def test_captions_and_paragraphs_are_read_beside_tables():
    table = markdown_table(["a", "b"], [["1", ""]])
    parts = read_tables(f"<!-- one -->\n\n{table}\n<!-- end of one -->\n\nTwo\nlines.\n\n{table}")
    assert [part if isinstance(part, str) else part.caption for part in parts] == ["one", "Two lines.", ""]
    assert parts[0].rows == [["1", ""]] and parts[0].to_right == [False, True]


SCRIPT = '''"""{name}?"""

from pathlib import Path

from PIL import Image

from kerrcaustics.report.study_records import write_record, write_text


def main(output: Path) -> list[Path]:
    {first}
    Image.new("L", (30, 12)).save(output / "{name}.png")
    write_text(output / "{name}.md", "| a |\\n| --- |\\n| 1 |\\n")
    return [write_record(output / "{name}.json", "{name}", __doc__, findings=["{name} ran"])]
'''


@pytest.mark.slow
def test_missing_studies_are_run_and_one_that_fails_is_reported(capfd, records, scripts_at):
    studies = records / "scripts"
    for name in ("accuracy", "good", "bad"):
        first = "1 / 0" if name == "bad" else "print(output)"
        (studies / name).mkdir(parents=True)
        (studies / name / "main.py").write_text(SCRIPT.format(name=name, first=first))
    scripts_at("STUDIES", studies)
    status, out, err = run(capfd, "study", "report", "--run")
    assert status == 1 and "Not run: bad" in out
    assert "bad: ZeroDivisionError: division by zero\n" in err and "failed: bad" in err and "Traceback" not in err
    page = Page((records / "report.html").read_text())
    assert "good ran" in page.text and "accuracy ran" not in page.text
    assert (records / "study-good" / "good.json").is_file()
