"""Pictures of the sky seen through the hole: as files, and on axes with the critical curves."""

import math
from collections.abc import Iterable, Mapping
from functools import singledispatch
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator

from kerrcaustics.curves.caustic import Caustic, CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.projection import azimuthal_equidistant, smoothed, whole_line
from kerrcaustics.scenes.picture_files import save_light as save_light, save_picture as save_picture
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.screen import Screen
from kerrcaustics.scenes.view import View
from kerrcaustics.shapes import Float, UInt8

Array = np.ndarray

# Over a picture of any colour a line needs a rim: by how many points it is wider than the line.
_RIM: dict[bool, dict[str, Any]] = {
    False: {"wider": 1.1, "foreground": "white", "alpha": 0.7},
    True: {"wider": 1.3, "foreground": "black", "alpha": 0.75},
}


def show_picture(
    ax: Axes,
    view: Raster,
    picture: UInt8[Array, "height width 3"],
    whole: View | None = None,
    middle: str = "picture's middle",
) -> Axes:
    """A picture (height, width, 3) uint8 of a view on axes, in pixels that are labelled as degrees from its centre.

    Degrees are true along the axes through the centre; for a fisheye view, along every line through it. whole: a view
    of which this one is a part; degrees then count from the centre of that one, as on its picture if it is a fisheye.
    middle: the name of that centre, "shadow's middle" for `View.toward_hole`.
    A screen is labelled by alpha and beta, or where it is turned by the lengths to the right and up from its centre.
    """
    ax.imshow(picture, interpolation="antialiased", extent=(-0.5, view.width - 0.5, view.height - 0.5, -0.5))
    _label(view, ax, whole, middle)
    return ax


@singledispatch
def _label(view: Raster, ax: Axes, whole: View | None, middle: str) -> None:
    """Ticks and names of the axes of a picture: one method for each class of rasters."""
    raise TypeError(f"no labels of {type(view).__name__}")


@_label.register
def _label_view(view: View, ax: Axes, whole: View | None, middle: str) -> None:
    if whole is None:
        _degrees(ax, view)
    else:
        _degrees_of(ax, view, whole)
    ax.set(xlabel=f"right of the {middle} (deg)", ylabel=f"above the {middle} (deg)")


@_label.register
def _label_screen(view: Screen, ax: Axes, whole: View | None, middle: str) -> None:
    upright = np.array_equal(view.up, (0.0, 1.0))
    centre = (view.width - 1) / 2, (view.height - 1) / 2
    for axis, pixels, start, step in (
        (ax.xaxis, np.array([-0.5, view.width - 0.5]), view.centre[0] * upright, view.pixel),
        (ax.yaxis, np.array([view.height - 0.5, -0.5]), view.centre[1] * upright, -view.pixel),
    ):
        ends = start + (pixels - centre[axis is ax.yaxis]) * step
        values = np.asarray(MaxNLocator(7, steps=[1, 2, 5, 10]).tick_values(*ends.tolist()))
        values = values[(values >= ends[0]) & (values <= ends[1])]
        _tick(axis, np.interp(values, ends, pixels), values)
    names = ("α (M)", "β (M)") if upright else ("right of the middle (M)", "above the middle (M)")
    ax.set(xlabel=names[0], ylabel=names[1])


def show_critical_curves(
    ax: Axes, view: Raster, caustics: Iterable[Caustic], *, on_black: bool = False, **line: Any
) -> Axes:
    """Critical curves over a picture of the same view and camera, one colour an order, as lines in its pixels.

    on_black: bright colours with a dark rim, for dark pictures. line: settings of the lines besides.
    """
    width = line.get("linewidth", 0.9)
    rim = {"linewidth": width, "path_effects": [_rim(width, **_RIM[on_black])]}
    for caustic in caustics:
        curve = whole_line(smoothed(caustic.sky), True) if caustic.closed else caustic.sky
        settings = {**style.order_line(caustic.order, on_black), **rim, **line}
        show_line(ax, view, curve, label=style.order_name(caustic.order), **settings)
    return ax


def _rim(width: float, wider: float, **look: Any) -> withStroke:
    return withStroke(linewidth=width + wider, **look)


def show_line(ax: Axes, view: Raster, sky: Float[Array, "n k"], **line: Any) -> Axes:
    """A line through places on the viewer's sky over a picture of the same view, in its pixels; the limits stay."""
    places = view.pixels(sky)
    step = np.diff(places, axis=0, prepend=places[:1], append=places[-1:])
    length = np.hypot(*step.T)
    # Where a picture of the whole sky ends at one side and goes on at the other, the line is broken, and each end led
    # on by a step, to the border.
    jump = np.flatnonzero(length[:-1] > view.width / 2)
    step[length > view.width / 20] = 0
    ends = np.stack([places[jump - 1] + step[jump - 1], np.full((len(jump), 2), np.nan), places[jump] - step[jump + 1]])
    places = np.insert(places, np.repeat(jump, 3), ends.swapaxes(0, 1).reshape(-1, 2), axis=0)
    ax.plot(*places.T, scalex=False, scaley=False, **line)
    return ax


def show_curve_names(ax: Axes, view: Raster, caustics: CausticSet, angles: Mapping[int, float]) -> Axes:
    """Names 1cc, 2cc, 3cc, as JTFT write them, beside critical curves on a picture.

    angles: for each order the place on the curve: degrees from the right over up, at the middle of the picture.
    """
    middle = np.array([(view.width - 1) / 2, (view.height - 1) / 2])
    for caustic in caustics:
        if caustic.order not in angles:
            continue
        places = view.pixels(caustic.sky) - middle
        direction = np.degrees(np.arctan2(-places[:, 1], places[:, 0]))
        away = np.abs((direction - angles[caustic.order] + 180) % 360 - 180)
        place = middle + places[int(np.nanargmin(away))]
        plate = {"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
        text = {"ha": "center", "va": "center", "fontsize": style.SMALLEST_TEXT, "fontweight": "bold", "bbox": plate}
        ax.annotate(f"{caustic.order}cc", tuple(place), color=style.order_colour(caustic.order), **text)
    return ax


def _degrees(ax: Axes, view: View) -> None:
    """Ticks at round angles from the centre."""
    ends = {}
    axes = np.stack([view.forward, view.right, view.up])
    for axis, row, size in ((ax.xaxis, 1, view.width), (ax.yaxis, 2, view.height)):
        middle = [(view.width - 1) / 2, (view.height - 1) / 2]
        middle[row - 1] = size - 0.5 if row == 1 else -0.5
        ends[row] = np.degrees(np.arccos(np.clip(view.directions(*middle)[0] @ axes[0], -1, 1)))
        step = style.tick_step(2 * ends[row], 7)
        angle = np.arange(-int(ends[row] / step + 1e-9), int(ends[row] / step + 1e-9) + 1) * float(step)
        turn = np.radians(angle)[:, None]
        _tick(axis, view.pixels(np.cos(turn) * axes[0] + np.sin(turn) * axes[row])[:, row - 1], angle)


def _degrees_of(ax: Axes, view: View, whole: View) -> None:
    """Ticks at round degrees of the picture of another view, as they are met along the middle row and column."""
    axes = np.stack([whole.forward, whole.right, whole.up])
    middle = (view.width - 1) / 2, (view.height - 1) / 2
    x, y = np.arange(view.width), np.arange(view.height)[::-1]
    across = azimuthal_equidistant(view.directions(x, middle[1])[0], axes)[:, 0]
    above = azimuthal_equidistant(view.directions(middle[0], y)[0], axes)[:, 1]
    for axis, degrees, pixels in ((ax.xaxis, across, x), (ax.yaxis, above, y)):
        step = style.tick_step(float(np.ptp(degrees)), 7)
        angle = np.arange(math.ceil(degrees[0] / step), math.floor(degrees[-1] / step) + 1) * float(step)
        _tick(axis, np.interp(angle, degrees, pixels), angle)


def _tick(axis: Axis, places: Float[Array, " n"], values: Float[Array, " n"]) -> None:
    """Ticks at places (n,) with the numbers (n,)."""
    axis.set_major_locator(FixedLocator(places.tolist()))
    texts = [style.number(float(value) + 0.0) for value in values]
    names = {round(float(place), 6): text for place, text in zip(places, texts, strict=True)}
    axis.set_major_formatter(FuncFormatter(lambda place, _: names.get(round(float(place), 6), "")))
