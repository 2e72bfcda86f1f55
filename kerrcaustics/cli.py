"""The command line. Degrees in and out; heavy modules are imported inside the commands."""

import json
import math
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import cyclopts
from rich import box
from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from kerrcaustics.curves.caustic import CausticSet

app = cyclopts.App(
    name="kerrcaustics",
    help="Caustics and critical curves of a spinning (Kerr) black hole, on the sky of a camera near it.",
    version=lambda: version("kerrcaustics"),
    suppress_keyboard_interrupt=False,
)

_FIGURE_ENDINGS = (".png", ".pdf", ".svg")
_DOTS_PER_INCH = 200
# The unrolled sky shows distances from the edge down to 1e-9 rad: a spline through as many points is good to 1e-15.
_EDGE_POINTS = 6000
_DEMO_SPIN, _DEMO_RADII = 0.999, (6.03, 2.6)


class BadInput(ValueError):
    """Something the user gave that cannot be: exit status 2, one line."""


def main() -> None:
    """Run the command line and exit: 0 done, 2 bad input (one line on standard error), 1 anything else."""
    signal.signal(signal.SIGINT, _interrupted)
    try:
        app(sys.argv[1:], exit_on_error=False, print_error=False)
    except cyclopts.CycloptsError as error:
        _stop(2, _one_line(str(error)))
    except BadInput as error:
        _stop(2, str(error))
    except Exception as error:
        if os.environ.get("KERRCAUSTICS_TRACEBACK"):
            raise
        _stop(1, f"{type(error).__name__}: {_one_line(str(error))} (KERRCAUSTICS_TRACEBACK=1 shows where)")


def _console(stderr: bool = False) -> Console:
    """Where tables go: never so narrow that digits would be cut off, unless a terminal is."""
    console = Console(stderr=stderr)
    return console if console.is_terminal else Console(stderr=stderr, width=100)


def _whole_number(_type: type, tokens: Sequence[cyclopts.Token]) -> int:
    """The number itself: 2.5 is refused, and not rounded."""
    try:
        return int(tokens[0].value)
    except ValueError:
        raise BadInput(f"Argument --orders must be a whole number, but is {tokens[0].value}.") from None


@app.command
def caustics(
    *,
    spin: float,
    radius: float,
    inclination: float = 90.0,
    velocity: Literal["circular", "fiducial", "static"] | None = None,
    orders: Annotated[int, cyclopts.Parameter(converter=_whole_number)] = 3,
    engine: Literal["auto", "closed-form", "integrated"] = "auto",
    tolerance: float = 1e-12,
    figure: Path | None = None,
    save: Path | None = None,
    json_: Annotated[str | None, cyclopts.Parameter(name="--json", allow_leading_hyphen=True)] = None,
    points: Annotated[bool, cyclopts.Parameter(negative=())] = False,
) -> None:
    """Find the critical curves and caustics that a camera sees, and print, draw or save them.

    Parameters
    ----------
    spin
        Spin a of the hole, 0 <= a < 1.
    radius
        Boyer-Lindquist radius of the camera, in units of the mass.
    inclination
        Angle of the camera from the spin axis, degrees: 90 is the equator.
    velocity
        Motion of the camera: on a circular geodesic orbit, with the fiducial observer, or static. By default
        circular where there is such an orbit, else fiducial. The caustics do not depend on it.
    orders
        How many caustics: 1 primary, 2 secondary, 3 tertiary, and on.
    engine
        What traces the beams.
    tolerance
        Wanted error of a beam, radians.
    figure
        Draw them into this file: .png, .pdf or .svg.
    save
        Save everything into this file, to be loaded with kerrcaustics.load_caustics.
    json_
        Write the numbers to this file as JSON; - is standard output.
    points
        Put the points of the curves into the JSON too.
    """
    if json_ is not None and json_ != "-" and json_.startswith("-"):
        raise BadInput(f"Argument --json must be a file name or -, but is {json_}.")
    _check_outputs({"--figure": figure, "--save": save, "--json": None if json_ in (None, "-") else Path(json_)})
    _check_ending(figure)
    if points and json_ is None:
        raise BadInput("Argument --points must come with --json.")
    if not 0 <= inclination <= 180:
        raise BadInput(f"Argument --inclination must lie in [0, 180] degrees, but is {inclination:g}.")
    with _plain_errors():
        from kerrcaustics.spacetime.camera import Camera

        camera = Camera(spin, radius, math.radians(inclination), velocity)
    with _plain_errors(), _progress() as report:
        from kerrcaustics.curves.caustic import caustics as find

        found = find(camera, orders, engine, tolerance, progress=report)
    if json_ is not None:
        _write_json(found, json_, points)
    if save is not None:
        from kerrcaustics.curves.store import save_caustics

        save_caustics(save, found)
    if figure is not None:
        _draw(found, figure)
    _print_table(found, _console(stderr=json_ == "-"))
    if found.missing:
        names = ", ".join(map(str, found.missing))
        _stop(1, f"Orders not found within double precision: {names}.")


@app.command
def demo(*, output: Path = Path("demo")) -> None:
    """Compute and draw the first three caustics of a = 0.999 at r = 6.03 and at r = 2.6 (JTFT figs 4, 5, 8, 9).

    Parameters
    ----------
    output
        Folder for the pictures; it is made when missing.
    """
    _make_folder(output)
    pictures = [output / f"caustics_a{_DEMO_SPIN}_r{radius}.png" for radius in _DEMO_RADII]
    _check_outputs({"--output": pictures[0]})
    console = _console()
    for radius, picture in zip(_DEMO_RADII, pictures, strict=True):
        with _progress(f"r = {radius}: ") as report:
            from kerrcaustics.curves.caustic import caustics as find
            from kerrcaustics.spacetime.camera import Camera

            found = find(Camera(_DEMO_SPIN, radius), 3, progress=report)
            report("drawing", 0.9)
            _draw(found, picture)
        _print_table(found, console)
    console.print("Pictures:")
    for picture in pictures:
        console.print(f"  {picture}", soft_wrap=True, highlight=False)


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
    _make_folder(folder)
    _check_outputs({"--output": folder / f"{name}.json"})
    files = run_study(name, folder)
    console = _console()
    console.print("Files:")
    for file in files:
        console.print(f"  {file}", soft_wrap=True, highlight=False)


def _make_folder(output: Path) -> None:
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"Argument --output must be a folder that can be made: {error.strerror}.") from None


def _check_outputs(paths: dict[str, Path | None]) -> None:
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


def _check_ending(figure: Path | None) -> None:
    if figure is not None and figure.suffix.lower() not in _FIGURE_ENDINGS:
        raise BadInput(f"Argument --figure must end in {', '.join(_FIGURE_ENDINGS)}, but is {figure}.")


@contextmanager
def _plain_errors() -> Iterator[None]:
    """Turn the package's own complaints about arguments into those of the command line."""
    try:
        yield
    except ValueError as error:
        message = str(error)
        if not message.startswith("Argument `"):
            raise
        name = message.split("`")[1]
        raise BadInput(message.replace(f"`{name}`", f"--{name}", 1)) from None


@contextmanager
def _progress(prefix: str = "") -> Iterator[Callable[[str, float], None]]:
    """A progress bar on standard error while it is a terminal, and nothing otherwise."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _what, _part: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(f"{prefix}loading and compiling", total=1.0)
        yield lambda what, part: bar.update(task, description=f"{prefix}{what}", completed=part)


def _write_json(found: "CausticSet", target: str, points: bool) -> None:
    from kerrcaustics.curves.store import record, writing

    text = json.dumps(record(found, points), indent=None if points else 2, allow_nan=False) + "\n"
    if target == "-":
        sys.stdout.write(text)
        return
    with writing(target) as file:
        file.write(text.encode())


def _draw(found: "CausticSet", path: Path) -> None:
    from kerrcaustics.curves.store import writing
    from kerrcaustics.draw.plots import overview
    from kerrcaustics.spacetime.shadow import shadow_edge

    picture = overview(found, shadow_edge(found.camera, _EDGE_POINTS))
    with writing(path) as file:
        picture.savefig(file, format=path.suffix[1:].lower(), dpi=_DOTS_PER_INCH)


def _print_table(found: "CausticSet", console: Console) -> None:
    camera = found.camera
    where = f"a = {camera.spin:.12g}, r = {camera.radius:.12g}, inclination {math.degrees(camera.inclination):.12g} deg"
    console.print(f"{where}, {camera.velocity} camera: full extents of the caustics", soft_wrap=True, highlight=False)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in ("order", "kind", "theta' (deg)", "phi' (deg)", "circuits", "cusps", "error (deg)"):
        table.add_column(name, justify="left" if name == "kind" else "right", no_wrap=True)
    for curve in found:
        table.add_row(
            str(curve.order),
            curve.kind,
            _sized(curve.theta_extent, curve.error),
            _sized(curve.phi_extent, curve.error),
            f"{curve.circuits:.4f}",
            str(len(curve.cusps)),
            f"{math.degrees(curve.error):.0e}",
        )
    console.print(table)
    for curve in found:
        for remark in curve.remarks:
            console.print(f"order {curve.order}: {remark}", soft_wrap=True, highlight=False)
    for order in found.missing:
        console.print(f"order {order}: not found", soft_wrap=True, highlight=False)
    residual = max((curve.residual for curve in found), default=0.0)
    console.print(
        f"{found.seconds:.2f} s, {found.beams} beams ({found.engine}), delta_minus / delta_plus at most {residual:.0e}",
        soft_wrap=True,
        highlight=False,
    )


def _sized(angle: float, error: float) -> str:
    """An angle in degrees with the digits that its error leaves, ten at most."""
    value, doubt = math.degrees(angle), math.degrees(error)
    if value < 1e-4:
        return f"{value:.2e}"
    digits = min(math.floor(-math.log10(doubt)), 9 - math.floor(math.log10(value)))
    return f"{value:.{max(digits, 0)}f}"


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _interrupted(*_: object) -> None:
    """End at once: an exception could be swallowed inside a compiled library."""
    store = sys.modules.get("kerrcaustics.curves.store")
    for name in list(store.UNFINISHED) if store else ():
        Path(name).unlink(missing_ok=True)
    # A progress bar hides the cursor while it runs.
    show_cursor = "\x1b[?25h\n" if sys.stderr.isatty() else ""
    sys.stderr.write(f"{show_cursor}kerrcaustics: Interrupted: nothing was left half-written.\n")
    sys.stderr.flush()
    os._exit(1)


def _stop(status: int, line: str) -> Any:
    sys.stderr.write(f"kerrcaustics: {line}\n")
    sys.exit(status)
