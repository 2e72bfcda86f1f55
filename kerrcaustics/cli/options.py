"""What the commands share: options, checks, progress, output."""

import json
import math
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import cyclopts
from rich import box
from rich.console import Console
from rich.table import Table

from kerrcaustics.cli.app import BadInput

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from kerrcaustics.scripts import ScriptFolder
    from kerrcaustics.spacetime.camera import Camera

_FIGURE_ENDINGS = (".png", ".pdf", ".svg")
_FILM_ENDINGS = (".mp4", ".gif")

Velocity = Literal["circular", "fiducial", "static"] | None
JsonTarget = Annotated[str | None, cyclopts.Parameter(name="--json", allow_leading_hyphen=True)]


def console(stderr: bool = False, width: int = 100) -> Console:
    """Where tables go: never so narrow that digits would be cut off, unless a terminal is."""
    console = Console(stderr=stderr)
    return console if console.is_terminal else Console(stderr=stderr, width=width)


def plain_table(heads: tuple[str, ...]) -> Table:
    """An empty table whose columns keep all their digits."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in heads:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def say(out: Console, text: str) -> None:
    """A line that no terminal width cuts up."""
    out.print(text, soft_wrap=True, highlight=False)


def whole_number(_type: type, tokens: Sequence[cyclopts.Token]) -> int:
    """The number itself: 2.5 is refused, and not rounded."""
    try:
        return int(tokens[0].value)
    except ValueError:
        raise BadInput(f"Argument {tokens[0].keyword} must be a whole number, but is {tokens[0].value}.") from None


WholeNumber = Annotated[int, cyclopts.Parameter(converter=whole_number, allow_leading_hyphen=True)]


def camera_at(spin: float, radius: float, inclination: float, velocity: Velocity) -> "Camera":
    """The camera that the options describe; inclination in degrees."""
    if not 0 <= inclination <= 180:
        raise BadInput(f"Argument --inclination must lie in [0, 180] degrees, but is {inclination:g}.")
    with plain_errors():
        from kerrcaustics.spacetime.camera import Camera

        return Camera(spin, radius, math.radians(inclination), velocity)


def place_of(camera: "Camera") -> str:
    """The camera, in words for a headline."""
    where = f"a = {camera.spin:.12g}, r = {camera.radius:.12g}, inclination {math.degrees(camera.inclination):.12g} deg"
    return f"{where}, {camera.velocity} camera"


def json_file(target: str | None) -> Path | None:
    """The file that --json names, or none where it is standard output."""
    if target is not None and target != "-" and target.startswith("-"):
        raise BadInput(f"Argument --json must be a file name or -, but is {target}.")
    return None if target in (None, "-") else Path(target)


def write_json(entry: dict[str, Any], target: str, indent: int | None = 2) -> None:
    """Write a record to a file, or to standard output."""
    text = json.dumps(entry, indent=indent, allow_nan=False) + "\n"
    if target == "-":
        sys.stdout.write(text)
        return
    from kerrcaustics.files import writing

    with writing(target) as file:
        file.write(text.encode())


def write_found(entry: dict[str, Any], target: str, seconds: float, indent: int | None = 2) -> None:
    """Write the record of a search, with how it was traced and how long it took."""
    write_json({**entry, "engine": "auto", "seconds": seconds}, target, indent)


def write_figure(picture: "Figure", path: Path) -> None:
    """Write a picture in the format that the file's ending names."""
    from kerrcaustics.draw.files import write_picture

    write_picture(picture, path)


def script_names(scripts: "ScriptFolder", what: str) -> list[str]:
    """Names of the scripts in a folder of the checkout; refused where there is none."""
    names = scripts.names()
    if not names:
        raise BadInput(f"{what} need a checkout of kerrcaustics, and there is none: no folder {scripts.folder}.")
    return names


def make_folder(output: Path) -> None:
    """Make the folder that --output names."""
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"Argument --output must be a folder that can be made: {error.strerror}.") from None


def check_outputs(paths: dict[str, Path | None]) -> None:
    """Refuse output files that cannot be written, before any work is done."""
    named = {argument: path for argument, path in paths.items() if path is not None}
    for argument, path in named.items():
        twin = next(other for other in named if named[other].absolute() == path.absolute())
        if twin != argument:
            raise BadInput(f"Argument {argument} must name another file than {twin}, but both are {path}.")
        if path.is_dir():
            raise BadInput(f"Argument {argument} must name a file, but {path} is a folder.")
        if path.exists() and not path.is_file():
            # A device or a pipe.
            continue
        if not path.parent.is_dir():
            raise BadInput(f"Argument {argument} must name a file in a folder that exists, but {path.parent} does not.")
        trial = path.parent / f".{path.name}.{os.getpid()}.part"
        try:
            trial.touch(exist_ok=False)
            trial.unlink()
        except OSError as error:
            raise BadInput(
                f"Argument {argument} must name a file that can be written: {path}: {error.strerror}."
            ) from None


def check_ending(figure: Path | None) -> None:
    """Refuse pictures of other formats."""
    if figure is not None and figure.suffix.lower() not in _FIGURE_ENDINGS:
        raise BadInput(f"Argument --figure must end in {', '.join(_FIGURE_ENDINGS)}, but is {figure}.")


def check_film(film: Path | None, argument: str = "--film") -> None:
    """Refuse films of other formats, or that cannot be written here."""
    if film is None:
        return
    if film.suffix.lower() not in _FILM_ENDINGS:
        raise BadInput(f"Argument {argument} must end in {' or '.join(_FILM_ENDINGS)}, but is {film}.")
    if film.suffix.lower() == ".mp4" and find_spec("av") is None:
        raise BadInput(
            f'Argument {argument}: MP4 needs the package av (pip install "kerrcaustics[films]"); .gif does not.'
        )


@contextmanager
def plain_errors() -> Iterator[None]:
    """Turn the package's own complaints about arguments into those of the command line."""
    try:
        yield
    except ValueError as error:
        message = str(error)
        if not message.startswith("Argument `"):
            raise
        name = message.split("`")[1]
        raise BadInput(message.replace(f"`{name}`", f"--{name.replace('_', '-')}", 1)) from None


@contextmanager
def progress(prefix: str = "", left: bool = False) -> Iterator[Callable[[str, float], None]]:
    """A progress bar on standard error while it is a terminal, and nothing otherwise; left: with the time left."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _what, _part: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    if left:
        columns += (TextColumn("left"), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(f"{prefix}loading and compiling", total=1.0)
        yield lambda what, part: bar.update(task, description=f"{prefix}{what}", completed=part)
