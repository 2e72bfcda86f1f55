"""Films: frames kept until the film is complete, then written as MP4 (H.264) or GIF.

A film that is interrupted goes on where it stopped: each frame is a file of its own beside the film until then.
What a frame shows is drawn elsewhere: caustics in `caustic_films`, a star over an orbit in `orbit_films`.
"""

import hashlib
import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from kerrcaustics.files import writing

Array = np.ndarray
Progress = Callable[[str, float], None]

SIZE = (1280, 720)
"""Width and height of a frame in pixels."""

ENDINGS = (".mp4", ".gif")
_DPI = 100
# Constant quality of H.264: 18 can hardly be told from the frames themselves.
_QUALITY = "18"
_COLOURS = 256


@dataclass(frozen=True)
class Film:
    """A film that can be drawn frame by frame, in any order.

    Attributes
    ----------
    name : str
        What it shows, in a word.
    settings : dict
        All that its frames depend on (numbers and strings): a film is continued only from frames of equal settings.
    frames : int
        How many.
    rate : int
        Frames per second.
    draw : callable
        Frame number, from 0, to a picture (height, width, 3) of bytes; both lengths even.
    """

    name: str
    settings: dict[str, Any]
    frames: int
    rate: int
    draw: Callable[[int], UInt8[Array, "height width 3"]]


def write_film(path: str | Path, film: Film, progress: Progress = lambda _what, _part: None) -> Path:
    """Draw the frames that are not there yet, write the film and return its path.

    Parameters
    ----------
    path : str or path
        Ends in .mp4 (H.264, yuv420p: plays everywhere) or .gif (256 colours a frame, plays for ever).
    film : Film
    progress : callable
        Called with what is being done, and which part of all frames is done.

    Notes
    -----
    Frames wait in a hidden folder beside the film, which goes when the film is complete. Those of a film with other
    settings are thrown away.
    """
    path = Path(path)
    if path.suffix.lower() not in ENDINGS:
        raise ValueError(f"Argument `path` must end in {' or '.join(ENDINGS)}, but is {str(path)!r}.")
    if not path.parent.is_dir():
        raise ValueError(f"Argument `path` must lie in a folder that exists, but {str(path.parent)!r} is none.")
    folder = frames_folder(path)
    _prepare(folder, film)
    for number in range(film.frames):
        frame = folder / f"{number:06d}.png"
        if not frame.exists():
            write_frame(frame, film.draw(number))
        progress(f"frame {number + 1} of {film.frames}", (number + 1) / film.frames)
    with writing(path) as file:
        (_write_gif if path.suffix.lower() == ".gif" else _write_mp4)(file, folder, film)
    shutil.rmtree(folder)
    return path


def write_frame(path: Path, picture: Array) -> None:
    """Write one frame (height, width, 3) of a film, bytes, both lengths even, as a PNG file."""
    picture = _checked(picture)
    with writing(path) as file:
        Image.fromarray(picture).save(file, format="PNG", compress_level=1)


def frames_folder(path: Path) -> Path:
    """Where the frames of an unfinished film are kept."""
    return path.with_name(f".{path.name}.frames")


def blank_frame() -> Figure:
    """An empty figure of the size of a frame; draw on it under `style.FILM_RC`."""
    return Figure(figsize=(SIZE[0] / _DPI, SIZE[1] / _DPI), dpi=_DPI)


def pixels(figure: Figure) -> UInt8[Array, "height width 3"]:
    """The picture (height, width, 3) of a figure, at its own resolution."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


class Backdrop:
    """A figure that is drawn once, and the artists that move on it: they alone are drawn for each frame."""

    def __init__(self, figure: Figure, moving: Sequence[Artist]) -> None:
        """Draw all but the moving artists."""
        self._canvas, self._figure = FigureCanvasAgg(figure), figure
        self._moving = sorted(moving, key=lambda artist: artist.get_zorder())
        for artist in self._moving:
            artist.set_animated(True)
        self._canvas.draw()
        self._still: Any = self._canvas.copy_from_bbox(figure.bbox)

    def pixels(self) -> UInt8[Array, "height width 3"]:
        """The picture (height, width, 3) with the moving artists where they are now."""
        self._canvas.restore_region(self._still)
        for artist in self._moving:
            (artist.axes or self._figure).draw_artist(artist)
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()


def _prepare(folder: Path, film: Film) -> None:
    """The folder for this film's frames; frames of another film in it are removed."""
    record = {
        "version": metadata.version("kerrcaustics"),
        "name": film.name,
        "frames": film.frames,
        "settings": film.settings,
    }
    mark = hashlib.sha256(json.dumps(record, sort_keys=True, default=str).encode()).hexdigest()
    note = folder / "film.txt"
    if folder.exists() and not (note.exists() and note.read_text(encoding="utf-8") == mark):
        shutil.rmtree(folder)
    folder.mkdir(exist_ok=True)
    note.write_text(mark, encoding="utf-8")


def _checked(picture: Array) -> UInt8[Array, "height width 3"]:
    picture = np.asarray(picture)
    shaped = picture.ndim == 3 and picture.shape[2] == 3 and picture.dtype == np.uint8
    if not shaped or picture.shape[0] % 2 or picture.shape[1] % 2:
        raise ValueError(
            "A frame of a film must be an array (height, width, 3) of bytes with even height and width, "
            f"but has shape {picture.shape} and type {picture.dtype}."
        )
    return picture


def _write_mp4(file: Any, folder: Path, film: Film) -> None:
    try:
        import av
    except ImportError:
        raise ImportError('MP4 films need the package av: pip install "kerrcaustics[films]"') from None
    with av.open(file, "w", format="mp4") as container:
        stream: Any = container.add_stream("libx264", rate=Fraction(film.rate))
        stream.pix_fmt = "yuv420p"
        stream.options = {"crf": _QUALITY, "preset": "medium"}
        stream.width, stream.height = Image.open(folder / f"{0:06d}.png").size
        for number in range(film.frames):
            picture = np.asarray(Image.open(folder / f"{number:06d}.png"))
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())


def _write_gif(file: Any, folder: Path, film: Film) -> None:
    # No dithering: it would flicker from frame to frame.
    pictures = (
        Image.open(folder / f"{number:06d}.png").quantize(_COLOURS, dither=Image.Dither.NONE)
        for number in range(film.frames)
    )
    first = next(pictures)
    # GIF counts in hundredths of a second.
    first.save(file, format="GIF", save_all=True, append_images=pictures, duration=round(100 / film.rate) * 10, loop=0)
