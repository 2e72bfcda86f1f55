"""What studies say of themselves in the help, and their quick runs."""

import ast
import json
import os
import re
import resource
import subprocess
import sys

import pytest
from command_line import run

from kerrcaustics.cli.study_list import WIDTH, study_lines, study_list, time_table
from kerrcaustics.report.study_records import find_records
from kerrcaustics.scripts import HOME, STUDIES, ScriptFolder

# A study that answers at once.
SCRIPT = '''"""Is it so?"""
from pathlib import Path
from PIL import Image
from kerrcaustics.report.study_records import write_record, write_text

QUESTION = "Is it so?"
QUICK = {"cases": 2}

def main(output: Path, cases: int = 9) -> list[Path]:
    Image.new("L", (30, 12)).save(output / "own.png")
    write_text(output / "own.md", "| a |\\n| --- |\\n| 1 |\\n")
    return [write_record(output / "own.json", "own", __doc__, settings={"cases": cases}, findings=["It is so."])]
'''


def constants(name):
    """The values at the top of a study's main.py, by name, and its function."""
    tree = ast.parse((HOME / "studies" / name / "main.py").read_text(encoding="utf-8"))
    values = {}
    for statement in tree.body:
        if isinstance(statement, ast.Assign | ast.AnnAssign):
            target = statement.target if isinstance(statement, ast.AnnAssign) else statement.targets[0]
            values[ast.unparse(target)] = statement.value
        elif isinstance(statement, ast.FunctionDef):
            values[statement.name] = statement
    return values


def test_each_study_says_what_it_answers_and_how_long_it_takes():
    lines = study_lines()
    assert [line.name for line in lines] == STUDIES.names() and len(lines) >= 15
    for line in lines:
        assert re.fullmatch(r"[A-Z].{8,}\?", line.question), line
        assert line.seconds > line.quick_seconds > 0 and line.quick_seconds < 60, line


def test_a_quick_run_takes_other_values_of_arguments_that_the_study_has():
    for name in STUDIES.names():
        found = constants(name)
        keys = [key.value for key in found["QUICK"].keys]
        assert keys and set(keys) <= {argument.arg for argument in found["main"].args.args}, name


def test_help_has_a_line_for_each_study_in_80_columns(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    status, out, _ = run(capsys, "study", "--help")
    assert status == 0 and max(map(len, out.splitlines())) <= WIDTH
    for line in study_lines():
        (shown,) = [text for text in out.splitlines() if text.startswith(f"  {line.name} ")]
        assert shown.endswith(f"  {line.question}") and re.search(r" \d+ (s|min) +\d+ s ", shown)


def test_the_page_of_studies_takes_its_times_from_the_studies():
    page = (HOME / "docs" / "studies.md").read_text(encoding="utf-8")
    assert "<!-- times -->" in page and all(f"| `{name}` |" not in page for name in STUDIES.names())
    assert all(f"| `{line.name}` | {line.question} |" in time_table() for line in study_lines())


@pytest.fixture
def own(tmp_path, monkeypatch, scripts_at):
    """A study of one's own, in the current folder."""
    (tmp_path / "studies" / "own").mkdir(parents=True)
    (tmp_path / "studies" / "own" / "main.py").write_text(SCRIPT)
    scripts_at("STUDIES", tmp_path / "studies")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_study_without_times_is_listed_too(own):
    assert study_list().splitlines()[1].split() == ["own", "Is", "it", "so?"]


def test_a_quick_run_is_said_to_be_one_in_record_and_report(capsys, own):
    assert run(capsys, "study", "own", "--quick", "--output", "quick")[0] == 0
    (record,) = find_records(own)
    assert record.quick and record.settings == {"quick": True, "cases": 2}
    status, out, _ = run(capsys, "study", "report", "--json", "report.json")
    assert status == 0 and "Quick, on fewer cases (remove their folders to run them in full): own" in out
    assert json.loads((own / "report.json").read_text())["quick"] == ["own"]
    text = (own / "report.html").read_text(encoding="utf-8")
    assert "Quick runs, on fewer cases than the studies have: Own." in text and "quick run, on fewer cases" in text


def test_a_full_run_is_not_said_to_be_quick(capsys, own):
    assert run(capsys, "study", "own", "--output", "full")[0] == 0
    (record,) = find_records(own)
    assert not record.quick and record.settings == {"cases": 9}
    assert run(capsys, "study", "report")[0] == 0
    assert "uick" not in (own / "report.html").read_text(encoding="utf-8")


def test_quick_and_full_runs_do_not_share_a_folder(capsys, own):
    for first, second in (("--quick", ""), ("", "--quick")):
        folder = own / f"first{first}"
        assert run(capsys, "study", "own", "--output", folder, *first.split())[0] == 0
        status, _, err = run(capsys, "study", "own", "--output", folder, *second.split())
        kind = "full" if second else "quick"
        assert status == 2 and f"--output must be a folder without a {kind} run of own, but is" in err
        assert run(capsys, "study", "own", "--output", folder, *first.split())[0] == 0


def test_a_report_is_quick_only_where_it_runs_studies(assert_refused):
    assert_refused(["study", "report", "--quick"], "--quick must be used together with --run")


@pytest.mark.slow
def test_a_report_runs_missing_studies_quickly(capfd, own):
    status, out, _ = run(capfd, "study", "report", "--run", "--quick")
    assert status == 0 and "Quick, on fewer cases" in out
    assert json.loads((own / "study-own" / "own.json").read_text())["settings"]["quick"] is True


def test_only_studies_run_quickly(tmp_path):
    script = type("Script", (), {"main": staticmethod(lambda output: [output])})
    folder = ScriptFolder("figure", tmp_path)
    object.__setattr__(folder, "load", lambda name: script)
    assert folder.run("any", tmp_path) == [tmp_path]
    with pytest.raises(AttributeError, match="QUICK"):
        folder.run("any", tmp_path, quick=True)


# Half of it or less where they were written: processors differ, and a busy one takes longer for the same work.
MOST_SECONDS = 60.0


@pytest.mark.slow
@pytest.mark.parametrize("name", STUDIES.names())
def test_a_quick_run_answers_in_less_than_a_minute_of_processor_time(name, tmp_path):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", "kerrcaustics", "study", name, "--quick", "--output", tmp_path / name]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"KERRCAUSTICS_TRACEBACK": "1"})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert done.returncode == 0, done.stderr
    (record,) = find_records(tmp_path)
    assert record.name == name and record.quick and record.findings
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < MOST_SECONDS
