"""Pictures as files, never half-written."""

from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from kerrcaustics.draw import style
from kerrcaustics.files import writing

# Fonts as outlines that every journal takes, rather than as Type 3 programs; text in SVG stays text.
_EMBEDDED: dict[Any, Any] = {"pdf.fonttype": 42, "ps.fonttype": 42, "svg.fonttype": "none"}


def write_picture(picture: Figure, path: Path) -> Path:
    """Write a picture in the format that the file's ending names; return the path."""
    # No date: the same picture is the same file.
    dated = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}
    ending = path.suffix[1:].lower()
    with writing(path) as file, rc_context(_EMBEDDED):
        picture.savefig(file, format=ending, dpi=style.RC["savefig.dpi"], metadata=dated.get(ending))
    return path


def write_line_art(picture: Figure, folder: Path, name: str) -> list[Path]:
    """Write a picture of lines as folder/name.png and, as vectors, folder/name.pdf; return both paths."""
    return [write_picture(picture, folder / f"{name}.{ending}") for ending in ("png", "pdf")]
