"""Plots of critical curves on the camera sky and of caustics on the celestial sphere.

Every function draws on the axes it is given and returns them; `overview` makes a figure. Curves that belong
together have one colour, and matching points of a critical curve and its caustic, the cusps, one letter.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, MultipleLocator, NullLocator

from kerrcaustics.curves.caustic import Caustic, CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.projection import (
    OVERLAP,
    TURNS,
    azimuthal_equidistant,
    unrolled_curve,
    unrolled_places,
    view_axes,
    whole_line,
)
from kerrcaustics.draw.sky_axes import (
    camera_sky_axes,
    critical_line,
    draw_mark,
    is_shapeless,
    outside_on_two_lines,
    seen_from_outside,
    unrolled_axes,
)
from kerrcaustics.draw.titles import headline
from kerrcaustics.shapes import Float

Array = np.ndarray

# Curves of higher order lie too close together on the camera sky for letters.
_HIGHEST_LETTERED = 3
# Of the picture's width: a curve smaller than this has no room for letters round it.
_ROOM = 0.2


def camera_sky(ax: Axes, caustics: CausticSet, edge: Float[Array, "n axes"]) -> Axes:
    """The camera sky as the camera sees it, looking at the hole: shadow and critical curves, in degrees.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    caustics : CausticSet
        Their critical curves, one line an order. Cusps up to order 3 are lettered in the curve's order; those
        of higher order, and of small curves, have no room here: their letters stand on `camera_sky_unrolled`.
    edge : (n, 3) array
        Directions N of the shadow edge, as `shadow_edge` returns them; of an Observer (alpha, beta).

    Notes
    -----
    The sky of an Observer is drawn as it is, alpha to the right and beta up, in M. Of a camera the projection is
    azimuthal equidistant about the middle of the shadow: angles from it are true. Up is -e_theta, the projected
    spin axis, and right is forward x up: +e_phi for a camera that moves along e_phi. Light with b > 0, which moves
    along +phi, comes from the left: there is the prograde, flat, edge.
    """
    axes = view_axes(caustics.camera, edge)
    outline = azimuthal_equidistant(edge, axes)
    ax.fill(*outline.T, label="shadow", **style.SHADOW)
    curves = [critical_line(caustic, axes) for caustic in caustics]
    span = float(np.ptp(np.concatenate([outline, *curves]), axis=0).max())
    for i, (caustic, curve) in enumerate(zip(caustics, curves, strict=True)):
        ax.plot(*curve.T, **_named_line(caustic))
        if caustic.order <= _HIGHEST_LETTERED and caustic.cusps and np.ptp(curve, axis=0).max() > _ROOM * span:
            cusps = azimuthal_equidistant(np.array([cusp.sky for cusp in caustic.cusps]), axes)
            outer = curves[i - 1] if i else None
            offsets = _camera_sky_offsets(cusps, caustic.order, outer, span)
            style.draw_letters(ax, cusps, offsets, caustic.order, leader=True)
    _frame(ax, np.concatenate([outline, *curves]), 1.0, 1.0)
    return camera_sky_axes(ax, style.tick_step(span, 7), caustics.camera.sky_unit)


def camera_sky_unrolled(ax: Axes, caustics: CausticSet, edge: Float[Array, "n axes"]) -> Axes:
    """Distance of the critical curves to the shadow edge against position angle, in degrees.

    Parameters
    ----------
    ax : Axes
        Where to draw; the distance axis is made logarithmic.
    caustics : CausticSet
        Their critical curves, one line an order, all cusps lettered.
    edge : (n, 3) array
        Directions N of the shadow edge, a smooth closed curve; n = 2000, above order 6 n = 6000, or more.

    Notes
    -----
    The position angle is measured at the shadow's middle on the picture of `camera_sky`, from the right (0)
    over up (90) to the left, prograde, side (180); a little more is shown at both ends. The distance is the
    angle to the nearest point of the edge.

    Errors: the edge is a periodic spline of degree five through its points. Measured at spin 0.999, distances
    are good to 2e-8 rad for n = 360, 3e-13 for 2000, 2e-15 for 6000. Points nearer than 1e-15 rad are left out.
    """
    axes = view_axes(caustics.camera, edge)
    distances = []
    for caustic in caustics:
        line = unrolled_curve(caustic.sky, axes, edge, caustic.closed)
        distances.append(line[:, 1])
        ax.plot(*line.T, **_named_line(caustic))
        if caustic.cusps:
            cusps = np.array([cusp.sky for cusp in caustic.cusps])
            _letter_unrolled(ax, unrolled_places(cusps, axes, edge), line, caustic.order)
    _distance_axis(ax, np.concatenate([[], *distances]))
    return unrolled_axes(ax, caustics.camera.sky_unit)


def celestial_sphere(ax: Axes, caustic: Caustic) -> Axes:
    """A caustic on the celestial sphere: theta' (0 at the top) against unwrapped phi', in degrees.

    phi' grows to the right, as on a globe seen from outside. Cusps are lettered in the curve's order, and
    multiples of 360 degrees (of 3600 where there are very many) are faint verticals. A caustic that is a
    point, or unresolved, is a cross.
    """
    curve = np.degrees(caustic.celestial[:, ::-1])
    if is_shapeless(caustic):
        curve = curve[:1]
        draw_mark(ax, caustic, curve[0])
    else:
        _draw_curve(ax, curve, caustic)
        _letter_around(ax, _cusp_angles(caustic), curve, caustic.order, flat=0.35)
    low, high = curve[:, 0].min(), curve[:, 0].max()
    # Letters on both sides have room within the axes of a narrow picture, too.
    margin = max(0.09 * (high - low), (60 - (high - low)) / 2)
    left, right = low - margin, high + margin
    circuits = 360 if right - left < 9000 else 3600
    for turn in range(math.ceil(left / circuits), math.floor(right / circuits) + 1):
        ax.axvline(circuits * turn, color=style.GUIDE_COLOUR, linewidth=0.5, zorder=0.5)
    ax.set(xlim=(left, right), ylim=(187, -7), xlabel=seen_from_outside(), ylabel="θ′ (deg)")
    ax.xaxis.set_major_locator(MultipleLocator(style.tick_step(right - left, 8)))
    ax.yaxis.set_major_locator(MultipleLocator(45))
    return ax


def primary_zoom(ax: Axes, caustic: Caustic) -> Axes:
    """A small caustic, such as the primary, in its true shape: theta' (down) and phi' from its centre.

    Angles are in degrees from the centre that the axis labels name; degrees of phi' are drawn shorter by
    sin(theta'), as they are on the sky (by 0.05 near a pole). Cusps are lettered; a caustic that is a point,
    or unresolved, is a cross.
    """
    curve = np.degrees(caustic.celestial[:, ::-1])
    if is_shapeless(caustic):
        curve = curve[:1]
    low, high = curve.min(axis=0), curve.max(axis=0)
    width = float((high - low).max())
    digits = min(max(0, 1 - math.floor(math.log10(width))), 12) if width > 0 else 3
    centre = np.round((low + high) / 2, digits)
    if is_shapeless(caustic):
        draw_mark(ax, caustic, curve[0] - centre)
        width = 1.0
        ax.set(xlim=(-0.5, 0.5), ylim=(-0.5, 0.5))
    else:
        _draw_curve(ax, curve - centre, caustic)
        _letter_around(ax, _cusp_angles(caustic) - centre, curve - centre, caustic.order)
        _frame(ax, curve - centre, max(math.sin(math.radians(centre[1])), 0.05), 1.3)
    ax.invert_yaxis()
    _name_offsets(ax, centre, digits, width)
    return ax


def overview(caustics: CausticSet, edge: Float[Array, "n axes"]) -> Figure:
    """Figure of the caustics of one camera: its sky, plain and unrolled, and every caustic.

    Parameters
    ----------
    caustics : CausticSet
        Of one camera, any number of orders.
    edge : (n, 3) array
        `shadow_edge(camera, n)`, n = 2000 or more, 6000 above order 6.

    Returns
    -------
    Figure
        7 inches wide, text of 7 points or more; save it with `figure.savefig`. Caustics below 10 degrees are
        drawn by `primary_zoom`, the others by `celestial_sphere`.
    """
    rows = _panel_rows(caustics)
    heights = [3.1] + [2.05] * len(rows)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, sum(heights) + 0.75), layout="constrained")
        grid = figure.add_gridspec(len(heights), 1, height_ratios=heights)
        top = grid[0].subgridspec(1, 2)
        sky = camera_sky(figure.add_subplot(top[0]), caustics, edge)
        sky.set_title("critical curves, camera sky")
        unrolled = camera_sky_unrolled(figure.add_subplot(top[1]), caustics, edge)
        unrolled.set_title("critical curves, unrolled")
        for i, row in enumerate(rows, start=1):
            widths = [_panel_width(caustic, len(caustics)) for caustic in row]
            places = grid[i].subgridspec(1, len(row), width_ratios=widths)
            for column, caustic in enumerate(row):
                _caustic_panel(figure.add_subplot(places[column]), caustic)
        handles, labels = sky.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=min(len(handles), 6))
        figure.suptitle(headline(caustics))
    return figure


def _caustic_panel(ax: Axes, caustic: Caustic) -> None:
    draw = primary_zoom if is_small(caustic) and not is_shapeless(caustic) else celestial_sphere
    draw(ax, caustic)
    remark = {"point": ", a point", "unresolved": ", unresolved"}.get(caustic.kind, "")
    if caustic.circuits > 0.5:
        remark = f", {caustic.circuits:.2f} circuits"
    ax.set_title(f"{style.order_name(caustic.order)} caustic{remark}")


def is_small(caustic: Caustic) -> bool:
    """Below 10 degrees: its true shape is seen only by itself."""
    return bool(max(caustic.theta_extent, caustic.phi_extent) < math.radians(10))


def _panel_width(caustic: Caustic, count: int) -> float:
    """Part of the page's width, in sixths, for one of `count` caustics; all of it for a few that wind."""
    if is_small(caustic):
        return 2
    return 6 if count <= 4 and caustic.circuits > 1.1 else 3


def _panel_rows(caustics: Sequence[Caustic]) -> list[list[Caustic]]:
    """The caustics in rows that are no wider than the page."""
    rows: list[list[Caustic]] = []
    room = 0.0
    for caustic in caustics:
        width = _panel_width(caustic, len(caustics))
        if width > room:
            rows.append([])
            room = 6.0
        rows[-1].append(caustic)
        room -= width
    return rows


def _named_line(caustic: Caustic) -> dict[str, Any]:
    """Line settings of an order, and its name for a legend."""
    return {"label": style.order_name(caustic.order), **style.order_line(caustic.order)}


def _draw_curve(ax: Axes, curve: Float[Array, "n 2"], caustic: Caustic) -> None:
    ax.plot(*whole_line(curve, caustic.closed).T, **_named_line(caustic))


def _camera_sky_offsets(
    cusps: Float[Array, "n 2"], order: int, outer: Float[Array, "m 2"] | None, span: float
) -> Float[Array, "n 2"]:
    """Offsets (n, 2) of letters from cusps (n, 2): outward where there is room, else into the shadow.

    outer (m, 2): the next critical curve outward, if there is one; span: the width of the picture.
    """
    outward = cusps / np.maximum(np.hypot(*cusps.T), 1e-9)[:, None]
    if order == 1 or outer is None:
        return style.LETTER_DISTANCE * outward
    room = np.hypot(*(cusps[:, None] - outer[None]).T).min(axis=0)
    # Turned aside, so that the letters that had to go in do not meet those of the next order.
    aside = 0.0 if order > 2 else math.radians(65)
    turn = np.array([[math.cos(aside), -math.sin(aside)], [math.sin(aside), math.cos(aside)]])
    inside = -2 * style.LETTER_DISTANCE * outward @ turn
    return np.where(((room > 0.075 * span) & (order == 2))[:, None], style.LETTER_DISTANCE * outward, inside)


def _free_side(points: Float[Array, "n 2"], line: Float[Array, "m 2"]) -> Float[Array, " n"]:
    """+1 or -1 (n,): whether there is room above or below points (n, 2) of a line (m, 2)."""
    line = line if line[-1, 0] > line[0, 0] else line[::-1]
    height = np.log10(line[:, 1])
    left, right = (np.interp(points[:, 0] + side * OVERLAP, line[:, 0], height) for side in (-1, 1))
    return np.where((left + right) / 2 - np.log10(points[:, 1]) > 0.02, -1.0, 1.0)


def _distance_axis(ax: Axes, distances: Float[Array, " n"]) -> None:
    """A logarithmic vertical axis for distances (n,), plain numbers as long as they are short."""
    ax.set_yscale("log")
    finite = distances[np.isfinite(distances)]
    if len(finite):
        room = max(2.5, (finite.max() / finite.min()) ** 0.1)
        ax.set_ylim(finite.min() / room, finite.max() * room)
    low, high = ax.get_ylim()
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 100 * low else (1.0,), numticks=8))
    ax.yaxis.set_minor_locator(NullLocator())
    if low > 1e-4:
        ax.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))


def _letter_unrolled(ax: Axes, cusps: Float[Array, "n 2"], line: Float[Array, "m 2"], order: int) -> None:
    """Letters of cusps above or below an unrolled line, a turn further on where they are seen there too."""
    offsets = style.LETTER_DISTANCE * np.outer(_free_side(cusps, line), (0, 1))
    for turn in TURNS:
        here = (np.abs(cusps[:, 0] + turn - 180) < 180 + OVERLAP) & np.isfinite(cusps[:, 1])
        style.draw_letters(ax, cusps + np.array([turn, 0]), offsets, order, shown=here)


def _letter_around(
    ax: Axes, cusps: Float[Array, "n 2"], curve: Float[Array, "m 2"], order: int, flat: float = 1.0
) -> None:
    """Letters of cusps (n, 2) on the side away from the middle of the curve; the vertical axis points down.

    flat: below 1 moves the letters beside the cusps rather than above or below them.
    """
    low, high = curve.min(axis=0), curve.max(axis=0)
    away = (cusps - (low + high) / 2) / np.maximum(high - low, 1e-300) * (1, -flat)
    away /= np.maximum(np.hypot(*away.T), 1e-9)[:, None]
    style.draw_letters(ax, cusps, style.LETTER_DISTANCE * away, order)


def _cusp_angles(caustic: Caustic) -> Float[Array, "n 2"]:
    return np.degrees([cusp.celestial[::-1] for cusp in caustic.cusps]).reshape(-1, 2)


def _name_offsets(ax: Axes, centre: Float[Array, "2"], digits: int, width: float) -> None:
    """Axis labels that name the centre and, for a very small caustic, the power of ten of the ticks."""
    power = 0 if width >= 0.01 else 3 * math.floor(math.log10(width) / 3)
    unit = "deg" if power == 0 else f"$10^{{{power}}}$ deg"
    for axis, name, value in ((ax.xaxis, "φ′", centre[0]), (ax.yaxis, "θ′", centre[1])):
        axis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]))
        axis.set_major_formatter(FuncFormatter(lambda x, _: f"{round(x / 10.0**power, 9) + 0.0:.4g}".replace("-", "−")))
        shift = np.format_float_positional(abs(value), precision=digits, trim="-")
        label = f"{name} {'+' if value < 0 else '−'} {shift} ({unit})"
        axis.set_label_text(outside_on_two_lines(label) if axis is ax.xaxis else label)


def _frame(ax: Axes, points: Float[Array, "n 2"], shrink: float, wide: float) -> None:
    """Limits with room for letters round points (n, 2) on a panel whose sides are as `wide` to 1.

    shrink: the length on the picture of a unit of x over that of a unit of y.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    middle, (width, height) = (low + high) / 2, high - low
    reach = 0.64 * max(width * shrink / wide, height)
    ax.set_xlim(middle[0] - wide * reach / shrink, middle[0] + wide * reach / shrink)
    ax.set_ylim(middle[1] - reach, middle[1] + reach)
    ax.set_aspect(1 / shrink, adjustable="box")
