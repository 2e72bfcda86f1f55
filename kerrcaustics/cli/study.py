"""The command `study`."""

from pathlib import Path

from kerrcaustics.cli.app import BadInput, app
from kerrcaustics.cli.options import check_outputs, console, make_folder


@app.command
def study(name: str, /, *, output: Path | None = None) -> None:
    """Run a study of this checkout (a script of its folder studies/) and say where its tables and pictures went.

    Parameters
    ----------
    name
        Which study: accuracy, cost or stability.
    output
        Folder for the files, by default study-NAME; it is made when missing.
    """
    from kerrcaustics.study import STUDIES, run_study, study_names

    names = study_names()
    if not names:
        raise BadInput(f"Studies need a checkout of kerrcaustics, and there is none: no folder {STUDIES}.")
    if name not in names:
        raise BadInput(f"Argument NAME must be one of {', '.join(names)}, but is {name}.")
    folder = output or Path(f"study-{name}")
    make_folder(folder)
    check_outputs({"--output": folder / f"{name}.json"})
    files = run_study(name, folder)
    out = console()
    out.print("Files:")
    for file in files:
        out.print(f"  {file}", soft_wrap=True, highlight=False)
