"""Overlays of a picture: critical curves, tracks of stars, names, a caption."""

import math
import re
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import is_color_like, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from kerrcaustics.curves.caustic_search import caustics
from kerrcaustics.draw import style
from kerrcaustics.draw.films import pixels
from kerrcaustics.draw.projection import whole_line
from kerrcaustics.draw.scenes import show_critical_curves, show_line
from kerrcaustics.draw.tracks import draw_motion, moving_lines
from kerrcaustics.images.images import star_images
from kerrcaustics.lens_map.arguments import HIGHEST_INDEX
from kerrcaustics.scene_files.camera_motion import PLACE_NAMES
from kerrcaustics.scene_files.cameras import CameraPath
from kerrcaustics.scene_files.contents import OverlaysTable
from kerrcaustics.scene_files.expressions import Moment
from kerrcaustics.scene_files.validation import SceneError, reject, table_errors
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.rendering import Rendering
from kerrcaustics.shapes import Bool, Float, UInt8
from kerrcaustics.spacetime.checks import quoted
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.tracks.tracks import star_tracks

Array = np.ndarray

_DPI = 100
# Smallest size of legible letters, pixels.
_LEAST_TYPE = 10.0
# Space between words and the sides of the picture, in units of the type.
_MARGIN = 0.9
# Space between words and the edge of their box, in units of the type.
_PADDING = 0.35
# Directions of the names beside curves from the middle of the curves, degrees, up from the right.
_BESIDE = (40.0, -40.0, 140.0, -140.0, 0.0, 180.0, 90.0, -90.0)
# Distance of the names from their curves, in units of the type.
_BEYOND = 1.6
LETTER_WIDTH = 0.6
"""Width of a letter, in units of the type."""
# Height of a caption, in units of the type.
_CAPTION_LINES = 3.0
# Opacity of the ground of names beside curves: higher than for captions, for colours on bright skies.
_PLATE = 0.8
# Digits of numbers in captions without a format.
_DIGITS = 4
# Height, pixels, of the pictures for which lines and type have their nominal size.
_HEIGHT = 720
_DARK = withStroke(linewidth=2.2, foreground="black", alpha=0.75)
# {name} or {name:.2f} in a caption: a name, and the format of a number of at most 99 places.
_BLANK = re.compile(r"\{(\w+)(?::([<>^]?[-+ ]?0?[0-9]{0,2},?(?:\.[0-9]{1,2})?[eEfFgG%]?))?\}")
_IN_BRACES = re.compile(r"\{[^}]*\}?|\}")
_LONGEST_CAPTION = 500
_EDGE_POINTS = 720
_EDGE_LINE: dict[str, Any] = {"color": "#B0B0B0", "linewidth": 1.0, "linestyle": "--", "path_effects": [_DARK]}
_POLE: dict[str, Any] = {"marker": "*", "markersize": 16.0, "markeredgecolor": "black", "linestyle": "none"}
# Cached, as they are the same for all frames of a camera on a circular orbit.
tracks_of, images_of = lru_cache(maxsize=64)(star_tracks), lru_cache(maxsize=8)(star_images)


def overlaid(
    picture: UInt8[Array, "height width 3"], overlays: OverlaysTable, rendering: Rendering, moment: Moment
) -> UInt8[Array, "height width 3"]:
    """The picture of a rendering with its overlays."""
    height, width = picture.shape[:2]
    # Bright lines with dark rims are visible on the black shadow and on bright skies.
    with rc_context(style.FILM_RC):
        figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI * max(height / _HEIGHT, 0.5))
        figure.set_size_inches(width / figure.dpi, height / figure.dpi)
        ax = figure.add_axes((0, 0, 1, 1))
        ax.set_axis_off()
        extent = (-0.5, width - 0.5, height - 0.5, -0.5)
        ax.imshow(picture, interpolation="nearest", extent=extent, aspect="auto")
        draw_lines(ax, overlays, rendering)
        if overlays.caption:
            _write(ax, filled_caption(overlays.caption, moment), overlays)
        drawing = pixels(figure)
    return drawing[:height, :width]


def draw_lines(ax: Axes, overlays: OverlaysTable, rendering: Rendering) -> None:
    """Draw the selected curves with their names."""
    camera, view = rendering.camera, rendering.view
    lines: list[Line2D] = []
    most = min(max(overlays.critical_curves - 1, 1), HIGHEST_INDEX)
    if overlays.tracks:
        _draw_tracks(ax, overlays.tracks, most, rendering)
        lines += [Line2D([], [], label=f"tracks, index {index}", **_track_line(index)) for index in range(most + 1)]
    if overlays.poles:
        _draw_poles(ax, most, rendering)
        lines.append(Line2D([], [], label="images of the poles", color=style.index_colour(0, on_black=True), **_POLE))
    if overlays.shadow_edge:
        edge = whole_line(shadow_edge(camera, _EDGE_POINTS), True)
        show_line(ax, view, edge, **_EDGE_LINE)
        lines.append(Line2D([], [], label="shadow edge", **_EDGE_LINE))
        if overlays.labels == "beside":
            # On the dark side: curves of high order lie outside.
            _write_name(ax, view, CurveName("shadow edge", edge, _EDGE_LINE["color"], 0.0, within=True), overlays)
    if overlays.critical_curves:
        curves = caustics(camera, overlays.critical_curves, end=rendering.sky_radius)
        own_colour: dict[str, Any] = {"color": overlays.curve_colour} if overlays.curve_colour else {}
        show_critical_curves(ax, view, curves, on_black=True, linewidth=1.6, **own_colour)
        for curve in (caustic for caustic in curves if _in_view(view, caustic.sky)):
            label = f"{style.order_name(curve.order)} critical curve"
            line = {**style.order_line(curve.order, on_black=True), **own_colour}
            listed = "critical curves" if own_colour else label
            if listed not in {known.get_label() for known in lines}:
                lines.append(Line2D([], [], linewidth=1.6, label=listed, **line))
            if overlays.labels == "beside":
                direction = _BESIDE[(curve.order - 1) % len(_BESIDE)]
                _write_name(ax, view, CurveName(label, curve.sky, line["color"], direction), overlays)
    if overlays.labels is True and lines:
        _list_names(ax, lines, overlays)


class CurveName(NamedTuple):
    """A name beside a curve.

    text: the name.
    sky: (n, axes) points of the curve.
    colour: colour of the name.
    direction: direction from the middle of the curve, degrees, up from the right.
    within: True for a name on the inner side of the curve.
    """

    text: str
    sky: Float[Array, "n axes"]
    colour: str
    direction: float
    within: bool = False


def _type_size(ax: Axes, overlays: OverlaysTable) -> float:
    """Size of the type in points, of which a picture has as many as its resolution says."""
    figure: Any = ax.figure
    height = figure.get_size_inches()[1] * figure.dpi
    return max(overlays.size / 100 * height, _LEAST_TYPE) * 72 / figure.dpi


def _list_names(ax: Axes, lines: list[Line2D], overlays: OverlaysTable) -> None:
    """Draw a legend with the names of all lines."""
    place: Any = overlays.labels_place.replace("centre", "center")
    size = _type_size(ax, overlays)
    look: dict[str, Any] = {"fontsize": size, "facecolor": _behind(overlays.colour), "framealpha": 0.6}
    legend: Any = ax.legend(handles=lines, loc=place, frameon=True, borderaxespad=_MARGIN - _PADDING, **look)
    legend.get_frame().set_linewidth(0)
    for text in legend.get_texts():
        text.set_color(overlays.colour)


def _write_name(ax: Axes, view: Raster, name: CurveName, overlays: OverlaysTable) -> None:
    """Draw the name of a curve beside it, in its colour, if there is room in the picture."""
    size = _type_size(ax, overlays)
    points, ends, room = places_beside(view, name, size * ax.figure.dpi / 72)
    if not room.max(initial=-np.inf) > -np.inf:
        return
    best = int(np.argmax(room))
    rightward = bool(ends[best, 0] > points[best, 0])
    look: dict[str, Any] = {"fontsize": size, "va": "center", "ha": "left" if rightward else "right"}
    leader = {"arrowstyle": "-", "color": name.colour, "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0}
    look["arrowprops"] = {**leader, "path_effects": [_DARK]}
    plate = {"boxstyle": f"square,pad={_PADDING / 2}", "facecolor": _behind(name.colour), "edgecolor": "none"}
    look |= {"color": name.colour, "bbox": {**plate, "alpha": _PLATE}}
    ax.annotate(name.text, tuple(points[best]), tuple(ends[best]), **look)


def places_beside(
    view: Raster, name: CurveName, letter: float
) -> tuple[Float[Array, "m 2"], Float[Array, "m 2"], Float[Array, " m"]]:
    """Points of a curve, starts of its name beside them, and scores of these places; -inf without room."""
    places, width = view.pixels(name.sky), LETTER_WIDTH * len(name.text) * letter
    middle = (np.nanmin(places, axis=0) + np.nanmax(places, axis=0)) / 2
    away = (places - middle) / np.linalg.norm(places - middle, axis=1, keepdims=True)
    angle = math.radians(name.direction)
    alignment = away @ [math.cos(angle), -math.sin(angle)]
    # The other side of the curve is used only if this side has no room.
    sides = (-1, 1) if name.within else (1, -1)
    ends = [places + side * _BEYOND * letter * away for side in sides]
    points, begin, score = np.tile(places, (2, 1)), np.concatenate(ends), np.concatenate([alignment, alignment - 2])
    end = begin + np.sign(begin - points) * [width, 0]
    # Room is also left for captions above or below.
    room = np.array([letter, _CAPTION_LINES * letter])
    inside = [((part > room) & (part < [view.width, view.height] - room)).all(axis=1) for part in (begin, end)]
    in_view = _inside(view, points)
    return points, begin, np.where(inside[0] & inside[1] & in_view, score, -np.inf)


def _behind(colour: str) -> str:
    """The ground on which words of a colour are legible: black or white."""
    return "black" if np.dot(to_rgb(colour), (0.2126, 0.7152, 0.0722)) > 0.4 else "white"


def _in_view(view: Raster, sky: Float[Array, "n axes"]) -> bool:
    """True if the picture shows some of these directions."""
    return bool(_inside(view, view.pixels(sky)).any())


def _inside(view: Raster, places: Float[Array, "n 2"]) -> Bool[Array, " n"]:
    """True for places in a picture."""
    return np.asarray(((places >= 0) & (places < [view.width, view.height])).all(axis=1))


def _track_line(index: int) -> dict[str, Any]:
    return {**style.index_line(index, on_black=True), "linewidth": 1.3, "path_effects": [_DARK]}


def _draw_tracks(ax: Axes, stars: tuple[float, ...], most: int, rendering: Rendering) -> None:
    view = rendering.view
    limits, lines = (ax.get_xlim(), ax.get_ylim()), []
    for i, theta in enumerate(stars):
        with table_errors("overlays", theta=f"overlays.tracks[{i}]", camera="overlays.tracks"):
            star = tracks_of(rendering.camera, math.radians(theta), most, end=rendering.sky_radius)
        for track in star.tracks:
            for index, places in moving_lines(star, track, view.pixels(track.sky), view.width / 2):
                lines.append((index, places))
                ax.plot(*places.T, **_track_line(index))
    ax.set(xlim=limits[0], ylim=limits[1])
    for index, places in lines:
        draw_motion(ax, places, style.index_colour(index, on_black=True), spacing=0.35, size=20)


def _draw_poles(ax: Axes, most: int, rendering: Rendering) -> None:
    """Five-pointed stars on the images of the two stars on the spin axis, in the colours of tracks."""
    for theta in (0.0, math.pi):
        images = images_of(rendering.camera, (theta, 0.0), most, end=rendering.sky_radius)
        for place, index in zip(rendering.view.pixels(images.sky), images.index, strict=True):
            ax.plot(*place, color=style.index_colour(index, on_black=True), scalex=False, scaley=False, **_POLE)


def _write(ax: Axes, text: str, overlays: OverlaysTable) -> None:
    """Draw a caption, wrapped to the width of the picture."""
    up, across = overlays.caption_place.replace("centre", "center").split()
    size = _type_size(ax, overlays)
    inset = ((0, 1, 0.5)[("left", "right", "center").index(across)], float(up == "upper"))
    shift = {"left": _MARGIN, "right": -_MARGIN, "center": 0.0}[across], -_MARGIN if up == "upper" else _MARGIN
    box = {"boxstyle": f"square,pad={_PADDING}", "facecolor": _behind(overlays.colour), "edgecolor": "none"}
    look: dict[str, Any] = {"ha": across, "va": "top" if up == "upper" else "bottom", "fontsize": size, "wrap": True}
    look |= {"color": overlays.colour, "bbox": {**box, "alpha": 0.6}, "parse_math": False}
    offset = (shift[0] * size, shift[1] * size)
    ax.annotate(text, inset, offset, xycoords="axes fraction", textcoords="offset points", **look)


def filled_caption(caption: str, moment: Moment) -> str:
    """A caption with the values of the names in braces."""

    def value(match: re.Match[str]) -> str:
        name = "t" if match[1] == "time" else match[1]
        number = moment.named(name).value
        return style.number(number, match[2] or _sensible_format(number))

    return _BLANK.sub(value, caption)


def _sensible_format(number: float) -> str:
    """The format of a number in a caption, to four digits; decimals are constant under small changes, as in films."""
    size = abs(number)
    if not 1e-3 <= size < 1e7:
        return f".{_DIGITS}g"
    places = max(_DIGITS - 1 - math.floor(math.log10(size)), 0)
    return "g" if number == round(number) and size < 1e6 else f".{places}f"


def check_overlays(overlays: OverlaysTable, path: CameraPath, span: tuple[float, float]) -> None:
    """Raise ValueError for captions with unknown names, and for tracks of cameras that do not circle the axis."""
    _check_caption(overlays.caption, {"time", "t", *PLACE_NAMES, *path.formulas})
    for name, colour in (("colour", overlays.colour), ("curve_colour", overlays.curve_colour or "white")):
        if not is_color_like(colour) or colour == "none":
            reject(f"overlays.{name}", "be a colour, as white or #FFD700", quoted(colour))
    if overlays.tracks:
        with table_errors("overlays", camera="overlays.tracks"):
            for time in span:
                path.camera(time)[0].orbital_velocity()


def _check_caption(caption: str, names: set[str]) -> None:
    """Raise ValueError for anything in braces but names with a simple format."""
    if len(caption) > _LONGEST_CAPTION:
        reject("overlays.caption", f"be at most {_LONGEST_CAPTION} characters long", f"{len(caption)} long")
    if control := next((letter for letter in caption if not (letter.isprintable() or letter == "\n")), None):
        reject("overlays.caption", "be printable, in one line or several", f"{quoted(caption)}, with {quoted(control)}")
    for part in _IN_BRACES.finditer(caption):
        blank = _BLANK.fullmatch(part[0])
        if blank is None:
            reject("overlays.caption", "have names in braces, as {t} or {radius:.2f}", quoted(part[0]))
        if blank[1] not in names:
            raise SceneError(f"overlays.caption must name {', '.join(sorted(names))} in braces, but names {blank[1]}.")
