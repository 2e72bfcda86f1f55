"""The command `check`."""

import sys
from pathlib import Path

from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput, stop
from kerrcaustics.cli.options import COMMON, CommonOptions, FileName, Flag
from kerrcaustics.cli.terminal import one_line_errors, plain_errors, say

_TEMPLATE = Path(__file__).parents[1] / "report" / "checks_template.toml"


@app.command(**with_examples("check checks.toml", "check --template > checks.toml"))
def check(file: FileName | None = None, /, *, template: Flag = False, common: CommonOptions = COMMON) -> None:
    """Check that caustics have the shapes, and stars the numbers of images, that a file requires.

    One line for each check, as soon as it is carried out. The exit status is 1 unless all are met.

    Parameters
    ----------
    file
        The check file, TOML: tables [[caustic]], [[star]] and [[stored]], as the template has them.
    template
        Print a commented check file as a starting point, and check nothing.
    """
    common.check()
    if template:
        if file is not None or common.json is not None:
            raise BadInput("Argument --template must be used alone.")
        sys.stdout.write(_TEMPLATE.read_text(encoding="utf-8"))
        return
    if file is None:
        raise BadInput("Argument FILE must be given.")
    with one_line_errors(), plain_errors():
        from kerrcaustics.report.checks import outcomes, read_checks

        checks = read_checks(file)
    out, found = common.console(), []
    with plain_errors():
        for outcome in outcomes(checks, file.parent):
            say(out, outcome.line)
            found.append(outcome)
    failed = sum(not outcome.met for outcome in found)
    common.write({"schema": "kerrcaustics/check/1", "met": not failed, "checks": [one.record() for one in found]})
    if failed:
        stop(1, f"{failed} of {len(found)} checks failed.")
    say(out, f"{len(found)} checks, all met")
