"""Axes of the camera sky, in degrees, and of the surfaces on which sources lie; critical curves and caustics on them.

Surfaces are a sphere, by phi' and theta', and the equatorial plane, from above.
"""

import math
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import ListedColormap
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator

from kerrcaustics.beams.ends import End
from kerrcaustics.curves.caustic import Caustic, CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.projection import OVERLAP, azimuthal_equidistant, smoothed, whole_line
from kerrcaustics.interop.physical_scale import PhysicalScale
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

REACH = 20.0
"""Radius (GM/c^2) at which curves in pictures from above end."""

_SKY_NAMES = "right of the shadow's middle (deg)", "above the shadow's middle (deg)"
_SCREEN_NAMES = "α (M)", "β (M)"
_SPHERE_NAME = "φ′ (deg)"
_HALO = withStroke(linewidth=3, foreground="white")
# Caustics below this extent, radians, are pointed out.
_SMALL = math.radians(4.0)
# An unresolved caustic of fewer errors than this has no shape.
_SHAPELESS = 1000
# Radians.
_LONGEST_ARC = math.radians(4.0)
# From the borders of the picture, degrees.
_AWAY = 1e-9


def camera_sky_axes(ax: Axes, step: float, unit: str = "rad") -> Axes:
    """Name the axes of a picture of the camera sky, of which `unit` is the `sky_unit`; a tick every `step`."""
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MultipleLocator(step))
    return name_sky_axes(ax, unit)


def name_sky_axes(ax: Axes, unit: str = "rad", scale: PhysicalScale | None = None) -> Axes:
    """Name the axes of a picture of the camera sky, and what is 0 on them; of an Observer alpha and beta.

    scale: with a distance, the ticks of alpha and beta are in microarcseconds.
    """
    right, up = _SKY_NAMES if unit == "rad" else _SCREEN_NAMES
    ax.set(xlabel=right, ylabel=up, aspect="equal")
    if unit != "rad" and scale is not None and scale.distance is not None:
        for axis in (ax.xaxis, ax.yaxis):
            _in_unit(axis, scale.microarcseconds)
        ax.set(xlabel="α (µas)", ylabel="β (µas)")
    return ax


def sky_length(viewer: Viewer, scale: PhysicalScale | None = None) -> tuple[str, float]:
    """Unit of lengths on pictures of a viewer's sky, as `name_sky_axes` has it, and what is drawn as 1 in it."""
    if viewer.sky_unit == "rad":
        return "deg", 1.0
    return ("M", 1.0) if scale is None or scale.distance is None else ("µas", scale.microarcseconds)


class _TicksInUnit(MaxNLocator):
    """Ticks at round numbers of a unit, of which one M is `each`."""

    def __init__(self, each: float) -> None:
        super().__init__(nbins="auto", steps=[1, 2, 2.5, 5, 10])
        self._each = each

    def tick_values(self, vmin: float, vmax: float) -> Any:
        return np.asarray(super().tick_values(vmin * self._each, vmax * self._each)) / self._each


def _in_unit(axis: Axis, each: float) -> None:
    """Ticks in a unit of which one M is `each`; what is drawn stays in M."""
    axis.set_major_locator(_TicksInUnit(each))
    axis.set_major_formatter(FuncFormatter(lambda place, _: style.number(place * each)))


def unrolled_axes(ax: Axes, unit: str = "rad") -> Axes:
    """Name the axes of an unrolled picture of the camera sky, position angle against distance to the shadow edge."""
    ax.set(xlim=(-OVERLAP, 360 + OVERLAP), ylabel=f"distance to shadow edge ({'deg' if unit == 'rad' else 'M'})")
    ax.set_xlabel("position angle (deg; 0 right, 90 up, 180 left)")
    ax.xaxis.set_major_locator(MultipleLocator(90))
    return ax


def seen_from_outside(name: str = _SPHERE_NAME) -> str:
    """The name of an axis of phi' that grows to the right: the camera, which is inside, sees it grow to the left."""
    return f"{name}, seen from outside"


def outside_on_two_lines(name: str) -> str:
    """The same for a narrow panel."""
    return seen_from_outside(name).replace(", ", ",\n")


def celestial_sphere_axes(ax: Axes, name: str = _SPHERE_NAME, step: float = 30, middle: float = 0.0) -> Axes:
    """Axes of the whole celestial sphere: phi' (`name`) about `middle`, theta' down, a tick every `step` degrees.

    Axes that have that name already keep their limits.
    """
    label = seen_from_outside(name)
    if ax.get_xlabel() != label:
        ax.set(xlim=(middle - 180, middle + 180), ylim=(180, 0), xlabel=label, ylabel="θ′ (deg)")
        ax.xaxis.set_major_locator(MultipleLocator(60))
        ax.xaxis.set_major_formatter(FuncFormatter(lambda phi, _: style.number(_named_azimuth(phi))))
        ax.yaxis.set_major_locator(MultipleLocator(step))
    return ax


def _named_azimuth(phi: float) -> float:
    """An azimuth, degrees, by whole turns between -180 and 180, both of which stay what they are."""
    return phi if abs(phi) <= 180 else 180 - (180 - phi) % 360


def critical_line(caustic: Caustic, axes: Float[Array, "..."]) -> Float[Array, "n 2"]:
    """Critical curve, in degrees or M, on the picture of `view_axes`, ready to be drawn: closed where it is."""
    return azimuthal_equidistant(whole_line(smoothed(caustic.sky), True) if caustic.closed else caustic.sky, axes)


def is_shapeless(caustic: Caustic) -> bool:
    """True for a caustic of which only the place is known: a point, or unresolved and next to its error in size."""
    size = max(caustic.theta_extent, caustic.phi_extent)
    return caustic.kind == "point" or bool(caustic.kind == "unresolved" and size < _SHAPELESS * caustic.error)


def point_out(ax: Axes, caustic: Caustic, place: Float[Array, "2"]) -> None:
    """The name of a caustic that is too small to be seen at a place, and a line to it; of a larger one nothing."""
    if is_shapeless(caustic) or max(caustic.theta_extent, caustic.phi_extent) > _SMALL:
        return
    colour = style.order_colour(caustic.order)
    arrow = {"arrowstyle": "-", "color": colour, "linewidth": 0.8, "shrinkB": 1, "path_effects": [_HALO]}
    text = {"textcoords": "offset points", "ha": "center", "color": colour, "path_effects": [_HALO]}
    ax.annotate(style.order_name(caustic.order), tuple(place), (0, 30), arrowprops=arrow, **text)


def draw_mark(ax: Axes, caustic: Caustic, place: Float[Array, "2"]) -> None:
    """A cross for a caustic that has no shape, at a place on the axes, and its name; one that is no point says so."""
    style.draw_cross(ax, place, caustic.order, "" if caustic.kind == "point" else ", unresolved")


def draw_wrapped(ax: Axes, caustic: Caustic, width: float, narrow: float, **settings: Any) -> None:
    """A caustic on axes of the whole celestial sphere, -180 to 180, a cross where it has no shape.

    width, narrow: of its line, where it goes round less than twice, and else; settings: of the line besides.
    """
    if is_shapeless(caustic):
        draw_mark(ax, caustic, wrapped(np.degrees(caustic.celestial[:1]))[0])
        return
    line = wrapped(np.degrees(whole_line(caustic.celestial, caustic.closed)))
    linewidth = width if caustic.circuits < 2 else narrow
    ax.plot(*line.T, linewidth=linewidth, **style.order_line(caustic.order), **settings)


def caustics_on_sphere(ax: Axes, caustics: CausticSet) -> Axes:
    """Caustics on axes of the whole celestial sphere, none of them torn.

    Those that go round less than once are whole: phi' runs about the middle of the largest of them, and farther where
    another one needs it. Those that go round more often run from border to border.
    """
    whole = [caustic for caustic in caustics if caustic.circuits < 1]
    if ax.get_xlabel() != seen_from_outside() and whole:
        largest = max(whole, key=lambda caustic: caustic.phi_extent)
        middle = _nearest_turn(_middle_phi(largest), 0.0)
        low, high = zip(*(_reach(caustic, middle) for caustic in whole), strict=True)
        celestial_sphere_axes(ax, middle=middle)
        ax.set_xlim(min(*low, middle - 180), max(*high, middle + 180))
    left, right = celestial_sphere_axes(ax).get_xlim()
    for caustic in caustics:
        _draw_at_turns(ax, caustic, left, right)
    return ax


def _draw_at_turns(ax: Axes, caustic: Caustic, left: float, right: float) -> None:
    """A caustic, wherever between two azimuths a part of it lies."""
    phi, theta = np.degrees(whole_line(caustic.celestial, caustic.closed)[:, ::-1]).T
    if is_shapeless(caustic):
        draw_mark(ax, caustic, np.array([_nearest_turn(_middle_phi(caustic), (left + right) / 2), theta[0]]))
        return
    name = style.order_name(caustic.order) + (", unresolved" if caustic.kind == "unresolved" else "")
    line: dict[str, Any] = {"linewidth": 1.1 if caustic.circuits < 2 else 0.7, **style.order_line(caustic.order)}
    centre = _nearest_turn(_middle_phi(caustic), (left + right) / 2)
    point_out(ax, caustic, np.array([centre, theta.mean()]))
    for i, turn in enumerate(_turns(phi, centre - _middle_phi(caustic), left, right)):
        line["label"] = "_" * bool(i) + name
        ax.plot(phi + turn, theta, **line)


def _turns(phi: Float[Array, " n"], nearest: float, left: float, right: float) -> list[float]:
    """Degrees by which a line is moved to be seen between two azimuths: the nearest turn alone if that is whole."""
    if left <= phi.min() + nearest and phi.max() + nearest <= right:
        return [nearest]
    first, last = math.ceil((left - phi.max()) / 360), math.floor((right - phi.min()) / 360)
    return [360.0 * turn for turn in range(first, last + 1)]


def _middle_phi(caustic: Caustic) -> float:
    return math.degrees(caustic.phi_min + caustic.phi_max) / 2


def _nearest_turn(phi: float, middle: float) -> float:
    """An azimuth, degrees, by whole turns within half a turn of another one."""
    return middle + 180 - (middle + 180 - phi) % 360


def _reach(caustic: Caustic, middle: float) -> tuple[float, float]:
    """Least and largest phi' of a caustic, degrees, next to a middle, with a little room."""
    centre, half = _nearest_turn(_middle_phi(caustic), middle), math.degrees(caustic.phi_extent) / 2 + 5
    return centre - half, centre + half


def wrapped(celestial: Float[Array, "n 2"]) -> Float[Array, "m 2"]:
    """Line of phi' in [-180, 180] and theta', degrees, of a curve of theta' and unwrapped phi'.

    A line that leaves the picture on one side is led to the border, broken, and begun again on the other.
    """
    pieces = []
    # A point on the border itself belongs to the side of larger phi'.
    on_border = (celestial[:, 1] + 180) % 360 == 0
    celestial = np.stack([celestial[:, 0], celestial[:, 1] + np.where(on_border, _AWAY, 0.0)], axis=-1)
    for start, end in pairwise(celestial):
        pieces += [start, *_crossings(start, end)]
    pieces.append(celestial[-1])
    theta, phi = np.array(pieces).T
    return np.stack([(phi + 180) % 360 - 180, theta], axis=-1)


def _crossings(start: Float[Array, "2"], end: Float[Array, "2"]) -> list[tuple[float, float]]:
    """Places (theta', phi') where a step leaves the picture, a gap, and where it comes in again, in this order."""
    places = []
    low, high = sorted((start[1], end[1]))
    for border in range(math.ceil((low + 180) / 360), math.floor((high + 180) / 360) + 1):
        phi = 360.0 * border - 180
        part = (phi - start[1]) / (end[1] - start[1]) if end[1] != start[1] else 0.0
        theta = start[0] + part * (end[0] - start[0])
        side = 1 if end[1] > start[1] else -1
        places += [(theta, phi - side * _AWAY), (math.nan, math.nan), (theta, phi + side * _AWAY)]
    return places


def draw_places(ax: Axes, surface: End, places: Float[Array, "n 2"], **settings: Any) -> Axes:
    """Draw places on a surface as points on its axes, as often as these show their longitudes."""
    source_axes(ax, surface)
    x, y = on_axes(ax, surface, places)
    if is_sphere(surface):
        low, high = sorted(ax.get_xlim())
        shifts = 360.0 * np.array([[0], [-1], [1]])
        at = x + shifts
        shown = (at >= low) & (at <= high) | (shifts == 0)
        x, y = at[shown], np.broadcast_to(y, at.shape)[shown]
    ax.plot(x, y, **{"linestyle": "none", "color": "black", **settings})
    return ax


def draw_totals(ax: Axes, surface: End, places: Float[Array, "n 2"], total: Int[Array, " n"]) -> Axes:
    """Draw places on a surface, coloured by how many images each has."""
    source_axes(ax, surface)
    colours = ListedColormap(colormaps["viridis"](np.linspace(0.05, 0.95, 16)))
    points = ax.scatter(*on_axes(ax, surface, places), c=total, s=12, cmap=colours)
    ax.figure.colorbar(points, ax=ax, label="images")
    return ax


def source_axes(ax: Axes, surface: End) -> Axes:
    """Name the axes of a picture of a surface."""
    return celestial_sphere_axes(ax) if is_sphere(surface) else from_above(ax)


def from_above(ax: Axes) -> Axes:
    """Name the axes of a picture seen along the spin axis, y upward."""
    ax.set(xlabel="x (M)", ylabel="y (M)", aspect="equal")
    return ax


def from_the_side(ax: Axes) -> Axes:
    """Name the axes of a picture seen along y, the spin axis upward."""
    ax.set(xlabel="x (M)", ylabel="z (M)", aspect="equal")
    return ax


def in_plane(places: Float[Array, "n 2"]) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """x and y of radii and azimuths."""
    return places[:, 0] * np.cos(places[:, 1]), places[:, 0] * np.sin(places[:, 1])


def draw_from_above(ax: Axes, caustic: Caustic, **settings: Any) -> None:
    """Draw a caustic in the plane as far as 20 M."""
    near = np.where(caustic.place[:, :1] < REACH, caustic.place, np.nan)
    line = rounded(whole_line(near, caustic.closed))
    ax.plot(*in_plane(line), **{**style.order_line(caustic.order), **settings})


def rounded(places: Float[Array, "n 2"]) -> Float[Array, "m 2"]:
    """A line of radii and azimuths with further places on steps of many degrees, which are arcs rather than chords."""
    parts = np.nan_to_num(np.abs(np.diff(places[:, 1])) / _LONGEST_ARC)
    number = np.concatenate([[0.0], np.cumsum(np.maximum(np.ceil(parts), 1))])
    fine = np.arange(number[-1] + 1)
    return np.stack([np.interp(fine, number, column) for column in places.T], axis=-1)


def on_axes(ax: Axes, surface: End, places: Float[Array, "n 2"]) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """x and y of places on the axes of a surface; phi' in degrees, within a turn from the left border."""
    if not is_sphere(surface):
        return in_plane(places)
    left = ax.get_xlim()[0]
    return (np.degrees(places[:, 1]) - left) % 360 + left, np.degrees(places[:, 0])


def is_sphere(surface: End) -> bool:
    """True if the coordinates of a surface are two angles."""
    return surface.coordinates[0].unit == "rad"
