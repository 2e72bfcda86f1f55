"""The command `figures`."""

import sys
import time
from pathlib import Path

from kerrcaustics.cli.app import BadInput, app, one_line, stop, with_examples
from kerrcaustics.cli.options import FileName
from kerrcaustics.cli.outputs import make_folder
from kerrcaustics.cli.script_names import script_names
from kerrcaustics.cli.terminal import console, progress, say


@app.command(**with_examples("figures", "figures star_field --output pictures"))
def figures(*names: str, output: FileName | None = None) -> None:
    """Make the figures (the scripts of the folder figures/ of a checkout) and say where each file went.

    A figure that fails is told on standard error; the others are made all the same, and the exit status is 1.

    Parameters
    ----------
    names
        Which figures, by the names of their scripts; all of them when none is named.
    output
        Folder for the files, by default figures/out of a checkout, else kerrcaustics-figures; it is made when missing.
    """
    from kerrcaustics.scripts import FIGURES, figures_folder

    known = script_names(FIGURES, "Figures")
    for name in names:
        if name not in known:
            raise BadInput(f"Argument NAMES must be some of {', '.join(known)}, but one is {name}.")
    wanted = list(dict.fromkeys(names)) or known
    folder = output or figures_folder(FIGURES)
    make_folder(folder)
    failed = []
    with progress(left=True) as report:
        for made, name in enumerate(wanted):
            report(f"{name} ({made + 1} of {len(wanted)})", made / len(wanted))
            if not _made(name, folder):
                failed.append(name)
    if failed:
        stop(1, f"{len(failed)} of {len(wanted)} figures could not be made: {', '.join(failed)}")


def _made(name: str, folder: Path) -> bool:
    """Whether a figure could be made; its files are told, and its failure."""
    from kerrcaustics.scripts import FIGURES

    began = time.perf_counter()
    try:
        files = FIGURES.run(name, folder)
    except Exception as error:
        print(f"kerrcaustics: figure {name}: {type(error).__name__}: {one_line(str(error))}", file=sys.stderr)
        return False
    out = console()
    say(out, f"{name} ({time.perf_counter() - began:.1f} s)")
    for file in files:
        say(out, f"  {file}")
    return True
