"""Fixtures that several test files share."""

from dataclasses import replace

import pytest
from command_line import run

from kerrcaustics import scripts
from kerrcaustics.curves.critical_curves import forget


@pytest.fixture
def scripts_at(monkeypatch):
    """Let the STUDIES, FIGURES or FILMS of the checkout lie in another folder."""

    def put(kind, folder):
        monkeypatch.setattr(scripts, kind, replace(getattr(scripts, kind), folder=folder))

    return put


@pytest.fixture
def assert_refused(capsys, tmp_path, monkeypatch):
    """Check that a command line is refused: one line on standard error, exit status 2, and no file written."""
    monkeypatch.chdir(tmp_path)

    def check(arguments, complaint):
        before = sorted(tmp_path.rglob("*"))
        status, out, err = run(capsys, *arguments)
        assert (status, out) == (2, "") and err.count("\n") == 1 and complaint in err
        assert sorted(tmp_path.rglob("*")) == before

    return check


@pytest.fixture
def nothing_kept():
    """Critical curves found before are not used, and those found now not afterwards: for who breaks the search."""
    forget()
    yield
    forget()
