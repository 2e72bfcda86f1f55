"""The command `study`."""

from pathlib import Path

from kerrcaustics.cli.app import BadInput, app
from kerrcaustics.cli.options import check_outputs, console, make_folder, say, script_names


@app.command
def study(name: str, /, *, output: Path | None = None) -> None:
    """Run a study of this checkout (a script of its folder studies/) and say where its tables and pictures went.

    Parameters
    ----------
    name
        Which study: accuracy, cost, far_camera, inclination, open_questions, spin_radius or stability.
    output
        Folder for the files, by default study-NAME; it is made when missing.
    """
    from kerrcaustics.scripts import STUDIES

    names = script_names(STUDIES, "Studies")
    if name not in names:
        raise BadInput(f"Argument NAME must be one of {', '.join(names)}, but is {name}.")
    folder = output or Path(f"study-{name}")
    make_folder(folder)
    check_outputs({"--output": folder / f"{name}.json"})
    files = STUDIES.run(name, folder)
    out = console()
    out.print("Files:")
    for file in files:
        say(out, f"  {file}")
