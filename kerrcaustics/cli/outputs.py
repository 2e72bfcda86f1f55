"""The files that commands write: checked before any work is done, never half-written."""

import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kerrcaustics.cli.endings import BadInput
from kerrcaustics.extras import missing
from kerrcaustics.files import OTHER_FORMATS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from kerrcaustics.interop.row_tables import RowTable

# Endings, and the word between them in messages.
_FIGURE = (".png", ".pdf", ".svg"), ", "
_PICTURE = (".png", ".jpg", ".jpeg", ".exr"), ", "
_FILM = (".mp4", ".gif"), " or "
_TABLE = (".csv", ".fits"), " or "
_PAGE = (".html", ".htm"), " or "
# Extras that endings need, and the package of each.
_NEEDS = {".exr": ("exr", "OpenEXR"), ".mp4": ("films", "av")}


def check_outputs(paths: dict[str, Path | None]) -> None:
    """Refuse output files that cannot be written, before any work is done."""
    named = {argument: path for argument, path in paths.items() if path is not None}
    for argument, path in named.items():
        twin = next(name for name in named if named[name].absolute() == path.absolute())
        if twin != argument:
            raise BadInput(f"Argument {argument} must name a different file from {twin}, but both are {path}.")
        if os.path.isdir(path):
            raise BadInput(f"Argument {argument} must name a file, but {path} is a folder.")
        if argument == "--save" and path.suffix.lower() in OTHER_FORMATS:
            raise BadInput(f"Argument --save must name a file of NumPy arrays, such as .npz, but is {path}.")
        # Else it is a device or a pipe.
        if os.path.isfile(path) or not os.path.exists(path):
            _check_folder(argument, path)


def _check_folder(argument: str, path: Path) -> None:
    """Refuse a file in a folder that is not there, or where nothing can be written."""
    if not os.path.isdir(path.parent):
        how = "is not a folder" if os.path.exists(path.parent) else "does not"
        raise BadInput(f"Argument {argument} must name a file in a folder that exists, but {path.parent} {how}.")
    _try(argument, "name a file that can be written", path)


def _try(argument: str, must: str, path: Path) -> None:
    """Refuse a name that no file can have: one is made beside it for a moment."""
    trial = path.parent / f".{path.name}.{os.getpid()}.part"
    try:
        trial.touch(exist_ok=False)
        trial.unlink()
    except OSError as error:
        raise BadInput(f"Argument {argument} must {must}: {path}: {error.strerror}.") from None


def check_store(argument: str, path: Path) -> None:
    """Refuse the name of a store, a folder, where there is something else, or where none can be made."""
    if os.path.exists(path) and not os.path.isdir(path):
        raise BadInput(f"Argument {argument} must name a store, which is a folder, but {path} is a file.")
    if not os.path.isdir(path.absolute().parent):
        raise BadInput(f"Argument {argument} must name a store in a folder that exists, but {path.parent} does not.")
    if not os.path.exists(path):
        _try(argument, "name a store that can be written", path)


def check_ending(figure: Path | None) -> None:
    """Refuse pictures of other formats."""
    _check_ending("--figure", figure, *_FIGURE)


def check_picture(output: Path) -> None:
    """Refuse rendered pictures of other formats, or that cannot be written here."""
    _check_ending("--output", output, *_PICTURE)


def check_film(film: Path | None, argument: str = "--film", restart: bool = False) -> None:
    """Refuse films of other formats, or that cannot be written here; and to restart none."""
    _check_ending(argument, film, *_FILM)
    if restart and film is None:
        raise BadInput(f"Argument --restart must be used with {argument}.")


def check_table(table: Path | None) -> None:
    """Refuse tables of other formats, or that cannot be written here."""
    _check_ending("--table", table, *_TABLE)


def check_page(page: Path | None, argument: str = "--page") -> None:
    """Refuse pages that do not look like pages."""
    _check_ending(argument, page, *_PAGE)


def write_table(result: "RowTable", table: Path, **settings: Any) -> None:
    """Write a result in rows into a file whose ending was checked; settings: of its methods."""
    (result.to_csv if table.suffix.lower() == ".csv" else result.to_fits)(table, **settings)


def _check_ending(argument: str, path: Path | None, endings: tuple[str, ...], between: str) -> None:
    if path is None:
        return
    ending = path.suffix.lower()
    if ending not in endings:
        raise BadInput(f"Argument {argument} must end in {between.join(endings)}, but is {path}.")
    if ending in _NEEDS and (lacking := missing(*_NEEDS[ending])):
        raise BadInput(f"Argument {argument}: {lacking}{'; .gif does not need it.' if ending == '.mp4' else '.'}")


def make_folder(output: Path, argument: str = "--output") -> None:
    """Make the folder that an argument names unless it exists; refuse one that nothing can be written into."""
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = "it is a file" if os.path.exists(output) else error.strerror
        raise BadInput(f"Argument {argument} must be a folder that can be made: {output}: {reason}.") from None
    _try(argument, "be a folder that can be written to", output / "x")


def write_json(entry: dict[str, Any], target: str, indent: int | None = 2, private: bool = False) -> None:
    """Write a record to a file, which only the user can read where it is private, or to standard output."""
    text = json.dumps(entry, indent=indent, allow_nan=False) + "\n"
    if target == "-":
        sys.stdout.write(text)
        return
    from kerrcaustics.files import writing

    with writing(target, private=private) as file:
        file.write(text.encode())


def write_figure(picture: "Figure", path: Path) -> None:
    """Write a picture in the format that the file's ending names."""
    from kerrcaustics.draw.picture_files import write_picture

    write_picture(picture, path)
