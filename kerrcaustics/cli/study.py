"""The commands `study` and `study report`."""

import json
import os
import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import Annotated

import cyclopts

from kerrcaustics.choices import suggestion
from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput, one_line, stop
from kerrcaustics.cli.options import COMMON, CommonOptions, FileName, Flag
from kerrcaustics.cli.outputs import check_outputs, check_page, make_folder
from kerrcaustics.cli.script_names import script_names
from kerrcaustics.cli.study_list import study_list
from kerrcaustics.cli.terminal import say

_USAGE = f"""Usage: kerrcaustics study NAME [--quick] [--output FOLDER] [--json FILE]
       kerrcaustics study report [FOLDER] [--run [--quick]] [--output FILE]
                                 [--json FILE]

{study_list()}
"""

study_app = cyclopts.App(
    name="study",
    help="Run a study, or collect the completed studies on one page.",
    usage=_USAGE,
    **with_examples("study accuracy", "study accuracy --quick", "study report --run"),
)
app.command(study_app)


@study_app.default
def study(
    name: str,
    /,
    *,
    quick: Flag = False,
    output: FileName | None = None,
    common: CommonOptions = COMMON,
) -> None:
    """Run a study (a folder NAME in studies/ of a checkout) and print the paths of its tables and pictures.

    `kerrcaustics study report` collects the completed studies on one page.

    Parameters
    ----------
    name
        Name of the study.
    quick
        Run it on fewer cases, in less than a minute. Its record and its report say so.
    output
        Folder for the files, by default study-NAME; created if missing.
    """
    from kerrcaustics.scripts import STUDIES

    names = script_names(STUDIES, "Studies")
    if name not in names:
        raise BadInput(f"Argument NAME must be one of {', '.join(names)}, but is {name}{suggestion(name, names)}")
    folder = output or Path(f"study-{name}")
    make_folder(folder)
    check_outputs({"--output": folder / f"{name}.json"})
    _check_unmixed(folder, name, quick)
    common.check()
    # A study prints its own tables.
    with redirect_stdout(sys.stderr if common.json == "-" else sys.stdout):
        files = STUDIES.run(name, folder, quick)
    if common.json is not None:
        common.write(json.loads((folder / f"{name}.json").read_text(encoding="utf-8")))
    out = common.console()
    out.print("Files:")
    for file in files:
        say(out, f"  {file}")


@study_app.command(**with_examples("study report", "study report results --output report.html --run"))
def report(
    folder: FileName = Path(),
    /,
    *,
    output: FileName = Path("report.html"),
    run: Annotated[bool, cyclopts.Parameter(negative=())] = False,
    quick: Flag = False,
    common: CommonOptions = COMMON,
) -> None:
    """Collect the completed studies on one HTML page: error against run time, stability, and the results of the others.

    The page contains its pictures and loads nothing. It lists the studies that have not been run, and those that were
    run with another version or on another machine.

    Parameters
    ----------
    folder
        Folder of the studies' files, including its subfolders; by default the current one.
    output
        File of the page.
    run
        First run the missing studies, one after the other, in FOLDER/study-NAME; `kerrcaustics study --help` has their
        times. A study that fails is reported and left out of the page; the exit status is then 1.
    quick
        With --run: run them on fewer cases. The page says so.
    """
    from importlib.metadata import version

    from kerrcaustics.report.page import write_report
    from kerrcaustics.scripts import STUDIES

    if not os.path.isdir(folder):
        raise BadInput(f"Argument FOLDER must be a folder that exists, but is {folder}.")
    if quick and not run:
        raise BadInput("Argument --quick must be used together with --run.")
    common.check({"--output": output})
    check_page(output, "--output")
    names = script_names(STUDIES, "Studies") if run else STUDIES.names()
    records = _records(folder)
    failed = _run_missing([name for name in names if name not in records], folder, quick) if run else []
    records = _records(folder) if run else records
    if not records:
        hint = "run one with `kerrcaustics study NAME`, or all of them with --run"
        raise BadInput(f"Argument FOLDER must hold records of studies, but {folder} has none: {hint}.")
    missing = [name for name in names if name not in records] if names else None
    write_report(output, list(records.values()), version("kerrcaustics"), missing)
    reduced = [name for name, record in records.items() if record.quick]
    entry = {"studies": list(records), "missing": missing or [], "failed": failed, "output": str(output)}
    entry["quick"] = reduced
    common.write({"schema": "kerrcaustics/report/1", **entry})
    out = common.console()
    say(out, f"Report: {output}: {', '.join(records)}")
    if reduced:
        say(out, f"Quick, on fewer cases (remove their folders to run them in full): {', '.join(reduced)}")
    if missing:
        say(out, f"Not run: {', '.join(missing)}")
    if failed:
        stop(1, f"{len(failed)} studies failed: {', '.join(failed)}")


def _records(folder: Path) -> dict:
    """Records of studies by name."""
    from kerrcaustics.report.study_records import find_records

    try:
        return {record.name: record for record in find_records(folder)}
    except ValueError as error:
        raise BadInput(one_line(str(error)).replace("`folder`", "FOLDER", 1)) from None


def _check_unmixed(folder: Path, name: str, quick: bool) -> None:
    """Refuse a folder that has a quick run where a full one is to be, or the other way round."""
    try:
        settings = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))["settings"]
        other = settings.get("quick", False) is not quick
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        # Nothing is there, or nothing whole.
        return
    if other:
        raise BadInput(
            f"Argument --output must be a folder without a {'full' if quick else 'quick'} run of {name}, but is "
            f"{folder}: name another one, or remove it."
        )


def _run_missing(names: list[str], folder: Path, quick: bool) -> list[str]:
    """Run studies, each in a process of its own, as times must not depend on others; return those that fail."""
    from kerrcaustics.scripts import STUDIES

    failed = []
    for done, name in enumerate(names):
        print(f"kerrcaustics: study {name} ({done + 1} of {len(names)})", file=sys.stderr, flush=True)
        output = folder / f"study-{name}"
        make_folder(output, "FOLDER")
        try:
            STUDIES.run_apart(name, output, quick)
        except RuntimeError:
            failed.append(name)
    return failed
