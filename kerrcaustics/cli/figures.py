"""The command `figures`."""

import sys
import time
from pathlib import Path
from typing import Any

from kerrcaustics.choices import suggestion
from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput, one_line, stop
from kerrcaustics.cli.options import COMMON, CommonOptions, FileName
from kerrcaustics.cli.outputs import make_folder
from kerrcaustics.cli.script_names import script_names
from kerrcaustics.cli.terminal import progress, say


@app.command(**with_examples("figures", "figures star_field --output pictures"))
def figures(*names: str, output: FileName | None = None, common: CommonOptions = COMMON) -> None:
    """Make the figures (the scripts in the folder figures/ of a checkout) and print the path of each file.

    A figure that fails is reported on standard error; the others are still made, and the exit status is 1.

    Parameters
    ----------
    names
        Names of the figures' scripts; by default all of them.
    output
        Folder for the files, by default figures/out in a checkout, else kerrcaustics-figures; created if missing.
    """
    from kerrcaustics.scripts import FIGURES, figures_folder

    available = script_names(FIGURES, "Figures")
    for name in names:
        if name not in available:
            raise BadInput(
                f"Argument NAMES must be some of {', '.join(available)}, but one is {name}{suggestion(name, available)}"
            )
    selection = list(dict.fromkeys(names)) or available
    folder = output or figures_folder(FIGURES)
    make_folder(folder)
    common.check()
    entries: list[dict[str, Any]] = []
    failed = []
    with progress(left=True) as report:
        for done, name in enumerate(selection):
            report(f"{name} ({done + 1} of {len(selection)})", done / len(selection))
            if (entry := _run_one(name, folder, common)) is None:
                failed.append(name)
            else:
                entries.append(entry)
    common.write({"schema": "kerrcaustics/figures/1", "figures": entries, "failed": failed})
    if failed:
        stop(1, f"{len(failed)} of {len(selection)} figures could not be made: {', '.join(failed)}")


def _run_one(name: str, folder: Path, common: CommonOptions) -> dict[str, Any] | None:
    """Run a script and print its files; None if it fails."""
    from kerrcaustics.scripts import FIGURES

    began = time.perf_counter()
    try:
        files = FIGURES.run(name, folder)
    except Exception as error:
        print(f"kerrcaustics: figure {name}: {type(error).__name__}: {one_line(str(error))}", file=sys.stderr)
        return None
    seconds, out = time.perf_counter() - began, common.console()
    say(out, f"{name} ({seconds:.1f} s)")
    for file in files:
        say(out, f"  {file}")
    return {"name": name, "seconds": seconds, "files": [str(file) for file in files]}
