"""The command `film`."""

from pathlib import Path

from kerrcaustics.cli.app import BadInput, app
from kerrcaustics.cli.checkout import script_names
from kerrcaustics.cli.options import WholeNumber
from kerrcaustics.cli.outputs import check_film, check_outputs
from kerrcaustics.cli.terminal import console, progress, say


@app.command
def film(name: str, /, *, output: Path | None = None, frames: WholeNumber | None = None) -> None:
    """Make a film of this checkout (a script of its folder figures/films/).

    It takes minutes. Interrupted and started again, it goes on where it stopped.

    Parameters
    ----------
    name
        Which film, by the name of its script.
    output
        The file, .mp4 (H.264) or .gif; by default NAME.mp4 in this folder.
    frames
        How many frames, 2 or more; by default as the script says.
    """
    from kerrcaustics.scripts import FILMS

    known = script_names(FILMS, "Films")
    if name not in known:
        raise BadInput(f"Argument NAME must be one of {', '.join(known)}, but is {name}.")
    if frames is not None and frames < 2:
        raise BadInput(f"Argument --frames must be 2 or more, but is {frames}.")
    path = output or Path(f"{name}.mp4")
    check_film(path, "--output")
    check_outputs({"--output": path})
    from kerrcaustics.draw.films import write_film

    with progress(left=True) as report:
        script = FILMS.load(name)
        write_film(path, script.film() if frames is None else script.film(frames), report)
    say(console(), f"Film: {path}")
