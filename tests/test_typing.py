"""The package as type checkers see it: a user's program in `typing/user_script.py`, checked by both."""

import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import kerrcaustics

HERE = Path(__file__).parent
SCRIPT = HERE / "typing" / "user_script.py"
LINES = SCRIPT.read_text(encoding="utf-8").splitlines()
WRONG = {number for number, line in enumerate(LINES, 1) if line.endswith("# wrong")}
# mypy without what it says of the package itself, as users have it of one that is installed.
CHECKERS = {
    "basedpyright": ["--pythonpath", sys.executable],
    "mypy": ["--python-executable", sys.executable, "--follow-imports=silent", "--cache-dir=cache"],
}


@pytest.mark.slow
@pytest.mark.parametrize("checker", CHECKERS)
def test_types_are_exact_and_what_is_wrong_is_an_error(checker, tmp_path):
    if find_spec(checker) is None:
        pytest.skip(f"{checker} is missing: pip install '.[lint]'")
    script, root = tmp_path / SCRIPT.name, str(HERE.parent)
    script.write_text("\n".join(LINES), encoding="utf-8")
    settings = f'{{"typeCheckingMode": "standard", "extraPaths": ["{root}"], "reportMissingModuleSource": false}}'
    (tmp_path / "pyrightconfig.json").write_text(settings, encoding="utf-8")
    command = [sys.executable, "-m", checker, *CHECKERS[checker], script.name]
    env = {**os.environ, "MYPYPATH": root}
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=env)
    errors = {int(number) for number in re.findall(rf"{script.name}:(\d+)[:\d]* (?:- )?error", done.stdout)}
    assert errors == WRONG, done.stdout


def test_the_script_calls_every_public_function():
    for name in set(kerrcaustics.__all__) - {"functional", "disks", "skies", "pictures"}:
        assert any(f"kc.{name}" in line for line in LINES), name


def test_the_package_says_that_it_is_typed():
    assert (Path(kerrcaustics.__file__).parent / "py.typed").is_file()
