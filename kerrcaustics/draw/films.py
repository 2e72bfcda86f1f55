"""Frames of films that are drawn as figures; `kerrcaustics.films` joins them.

The pictures themselves: caustics in `caustic_films`, a star over an orbit in `orbit_films`, a great circle in
`circles`, a spot in `spot_films`.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from kerrcaustics.films.film import Film as Film, write_film as write_film
from kerrcaustics.shapes import UInt8
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

SIZE = (1280, 720)
"""Width and height of a frame in pixels."""

_DPI = 100


def blank_frame() -> Figure:
    """An empty figure of the size of a frame; draw on it under `style.FILM_RC`."""
    return Figure(figsize=(SIZE[0] / _DPI, SIZE[1] / _DPI), dpi=_DPI)


def pixels(figure: Figure) -> UInt8[Array, "height width 3"]:
    """The picture (height, width, 3) of a figure, at its own resolution."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def camera_settings(camera: Viewer) -> dict[str, Any]:
    """The camera, among the settings of a film."""
    return {name: getattr(camera, name) for name in ("spin", "radius", "inclination", "velocity")}


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
