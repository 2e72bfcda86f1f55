"""Overlays of a picture: critical curves, tracks of stars, names, a caption."""

import math
import re
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from kerrcaustics.curves.caustic_search import caustics
from kerrcaustics.draw import style
from kerrcaustics.draw.films import pixels
from kerrcaustics.draw.projection import whole_line
from kerrcaustics.draw.scenes import show_critical_curves, show_line
from kerrcaustics.draw.tracks import draw_motion, moving_lines
from kerrcaustics.images.sheets import HIGHEST_INDEX
from kerrcaustics.scene_files.camera_motion import PLACE_NAMES
from kerrcaustics.scene_files.cameras import CameraPath
from kerrcaustics.scene_files.contents import OverlaysTable
from kerrcaustics.scene_files.expressions import Moment
from kerrcaustics.scene_files.validation import SceneError, about, reject
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.render import Rendering
from kerrcaustics.spacetime.checks import quoted
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.tracks import star_tracks

Array = np.ndarray

_DPI = 100
# Lines and type are made for pictures so many pixels high, and grow with them.
_HEIGHT = 720
_DARK = withStroke(linewidth=2.2, foreground="black", alpha=0.75)
# {name} or {name:.2f} in a caption: a name, and the format of a number of at most 99 places.
_BLANK = re.compile(r"\{(\w+)(?::([<>^]?[-+ ]?0?[0-9]{0,2},?(?:\.[0-9]{1,2})?[eEfFgG%]?))?\}")
_IN_BRACES = re.compile(r"\{[^}]*\}?|\}")
_LONGEST_CAPTION = 500
_EDGE_POINTS = 720
_EDGE_LINE: dict[str, Any] = {"color": "#B0B0B0", "linewidth": 1.0, "linestyle": "--", "path_effects": [_DARK]}
# The same for all frames of a camera on a circular orbit.
_tracks = lru_cache(maxsize=64)(star_tracks)


def overlaid(
    picture: UInt8[Array, "height width 3"], overlays: OverlaysTable, rendering: Rendering, moment: Moment
) -> UInt8[Array, "height width 3"]:
    """The picture of a rendering with its overlays."""
    height, width = picture.shape[:2]
    # Bright lines do with dark rims what dark ones cannot on a black shadow.
    with rc_context(style.FILM_RC):
        figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI * max(height / _HEIGHT, 0.5))
        figure.set_size_inches(width / figure.dpi, height / figure.dpi)
        ax = figure.add_axes((0, 0, 1, 1))
        ax.set_axis_off()
        extent = (-0.5, width - 0.5, height - 0.5, -0.5)
        ax.imshow(picture, interpolation="nearest", extent=extent, aspect="auto")
        _draw(ax, overlays, rendering.camera, rendering.view)
        if overlays.caption:
            _write(ax, _filled(overlays.caption, moment))
        drawing = pixels(figure)
    return drawing[:height, :width]


def _draw(ax: Axes, overlays: OverlaysTable, camera: Viewer, view: Raster) -> None:
    lines: list[Line2D] = []
    if overlays.tracks:
        most = min(max(overlays.critical_curves - 1, 1), HIGHEST_INDEX)
        _draw_tracks(ax, overlays.tracks, most, camera, view)
        lines += [Line2D([], [], label=f"tracks, index {index}", **_track_line(index)) for index in range(most + 1)]
    if overlays.shadow_edge:
        show_line(ax, view, whole_line(shadow_edge(camera, _EDGE_POINTS), True), **_EDGE_LINE)
        lines.append(Line2D([], [], label="shadow edge", **_EDGE_LINE))
    if overlays.critical_curves:
        curves = caustics(camera, overlays.critical_curves)
        show_critical_curves(ax, view, curves, on_black=True, linewidth=1.6)
        for order in (caustic.order for caustic in curves if _in_view(view, caustic.sky)):
            label = f"{style.order_name(order)} critical curve"
            lines.append(Line2D([], [], linewidth=1.6, label=label, **style.order_line(order, on_black=True)))
    if overlays.labels and lines:
        legend: Any = ax.legend(handles=lines, loc="lower left", frameon=True, facecolor="black", framealpha=0.6)
        legend.get_frame().set_linewidth(0)
        for text in legend.get_texts():
            text.set_color("white")


def _in_view(view: Raster, sky: Float[Array, "n axes"]) -> bool:
    """True where the picture shows some of these directions."""
    x, y = view.pixels(sky).T
    return bool(((x >= 0) & (x < view.width) & (y >= 0) & (y < view.height)).any())


def _track_line(index: int) -> dict[str, Any]:
    return {**style.index_line(index, on_black=True), "linewidth": 0.9, "path_effects": [_DARK]}


def _draw_tracks(ax: Axes, stars: tuple[float, ...], most: int, camera: Viewer, view: Raster) -> None:
    limits, lines = (ax.get_xlim(), ax.get_ylim()), []
    for i, theta in enumerate(stars):
        with about("overlays", theta=f"overlays.tracks[{i}]", camera="overlays.tracks"):
            star = _tracks(camera, math.radians(theta), most)
        for track in star.tracks:
            for index, places in moving_lines(star, track, view.pixels(track.sky), view.width / 2):
                lines.append((index, places))
                ax.plot(*places.T, **_track_line(index))
    ax.set(xlim=limits[0], ylim=limits[1])
    for index, places in lines:
        draw_motion(ax, places, style.index_colour(index, on_black=True), spacing=0.35, size=20)


def _write(ax: Axes, text: str) -> None:
    box = {"boxstyle": "square,pad=0.35", "facecolor": "black", "edgecolor": "none", "alpha": 0.6}
    ax.text(0.015, 0.975, text, transform=ax.transAxes, color="white", va="top", ha="left", bbox=box, parse_math=False)


def _filled(caption: str, moment: Moment) -> str:
    """A caption with the values of the names in braces."""

    def value(match: re.Match[str]) -> str:
        name = "t" if match[1] == "time" else match[1]
        return style.number(moment.named(name).value, match[2] or "g")

    return _BLANK.sub(value, caption)


def check_overlays(overlays: OverlaysTable, path: CameraPath, span: tuple[float, float]) -> None:
    """Raise ValueError for captions with unknown names, and for tracks of cameras that do not circle the axis."""
    _check_caption(overlays.caption, {"time", "t", *PLACE_NAMES, *path.formulas})
    if overlays.tracks:
        with about("overlays", camera="overlays.tracks"):
            for time in span:
                path.camera(time)[0].orbital_velocity()


def _check_caption(caption: str, names: set[str]) -> None:
    """Raise ValueError for anything in braces but names with a simple format."""
    if len(caption) > _LONGEST_CAPTION:
        reject("overlays.caption", f"be at most {_LONGEST_CAPTION} characters long", f"{len(caption)} long")
    for part in _IN_BRACES.finditer(caption):
        blank = _BLANK.fullmatch(part[0])
        if blank is None:
            reject("overlays.caption", "have names in braces, as {t} or {radius:.2f}", quoted(part[0]))
        if blank[1] not in names:
            raise SceneError(f"overlays.caption must name {', '.join(sorted(names))} in braces, but names {blank[1]}.")
