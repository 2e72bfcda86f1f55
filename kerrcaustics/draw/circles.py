"""The images of a great circle: on the camera sky, unrolled at the shadow edge, and the circle among the caustics.

A figure of one circle, and frames of one orbit of a camera, over which the circle turns about the spin axis.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.curves.caustic_search import caustics as caustics_of
from kerrcaustics.draw import style
from kerrcaustics.draw.films import Backdrop, Film, blank_frame, camera_settings
from kerrcaustics.draw.palettes import STAR_COLOUR
from kerrcaustics.draw.projection import (
    TURNS,
    azimuthal_equidistant,
    broken,
    position_angle,
    unrolled,
    unrolled_curve,
    unrolled_places,
    view_axes,
    whole_line,
)
from kerrcaustics.draw.sky_axes import (
    camera_sky_axes,
    celestial_sphere_axes,
    critical_line,
    draw_wrapped,
    seen_from_outside,
    unrolled_axes,
    wrapped,
)
from kerrcaustics.draw.titles import headline
from kerrcaustics.shapes import Float, UInt8
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.spacetime.sphere import polar_angle
from kerrcaustics.tracks.circles import CircleImages, circle_images
from kerrcaustics.tracks.lines import LineCrossings, crossings_of_line, places_on_line

Array = np.ndarray

Line = float | Float[Array, "2 axes"]
"""A line of `crossings_of_line`."""

Pair = tuple[Float[Array, "_ 2"], Float[Array, "_ 2"]]
"""Places on the camera sky, and on the same unrolled."""

_EDGE_POINTS, _CIRCLE_POINTS = 2000, 721
_BREAK = np.full((1, 2), np.nan)
_CIRCLE: dict[str, Any] = {"color": STAR_COLOUR, "linewidth": 1.2, "zorder": 3}
_LINE: dict[str, Any] = {"color": "#777777", "linewidth": 0.8, "linestyle": (0, (2, 2)), "zorder": 1.7}
_DOT: dict[str, Any] = {"marker": "o", "markersize": 3.4, "markeredgecolor": "black", "markeredgewidth": 0.6}


class CirclePanels:
    """Pictures of the images of great circles on three axes: camera sky, the same unrolled, sphere of the circle.

    What all circles share is drawn once.

    Attributes
    ----------
    moving : list
        The artists that `show` changes.
    """

    def __init__(self, axes: tuple[Axes, Axes, Axes], caustics: CausticSet, max_index: int) -> None:
        """Shadow, critical curves and caustics; these are of orders to max_index + 1."""
        self._camera, self._panels = caustics.camera, axes
        self._edge = shadow_edge(caustics.camera, _EDGE_POINTS)
        self._view = view_axes(caustics.camera, self._edge)
        self._draw_curves(caustics)
        sky, near, sphere = axes
        self._images = [[_line(ax, index) for ax in (sky, near)] for index in range(max_index + 1)]
        self._dots = [[_line(ax, index, **_DOT) for ax in (sky, near)] for index in range(max_index + 1)]
        (self._circle,) = sphere.plot([], [], **_CIRCLE)
        self.moving = [self._circle, *(line for pair in self._images + self._dots for line in pair)]

    def show(self, circle: CircleImages, crossings: Sequence[LineCrossings] = ()) -> None:
        """Draw a circle of the same viewer, its images, and the crossings of lines with them as dots."""
        index = np.concatenate([np.empty(0), *(one.index for one in crossings)])
        sky = np.concatenate([self._edge[:0], *(one.sky for one in crossings)])
        *curves, dots = self._pictures([*(curve.sky for curve in circle.curves), sky])
        for k, pair in enumerate(self._images):
            for line, places in zip(pair, self._lines(circle, curves, k), strict=True):
                line.set_data(*places.T)
        for k, pair in enumerate(self._dots):
            for line, places in zip(pair, dots, strict=True):
                line.set_data(*places[index == k].T)
        self._circle.set_data(*_on_sphere(circle).T)

    def show_line(self, circle: CircleImages, line: Line) -> None:
        """Draw a line along which crossings are counted."""
        for ax, places in zip(self._panels, self._pictures([places_on_line(circle, line)])[0], strict=False):
            ax.plot(*self._broken(places).T, scalex=False, scaley=False, **_LINE)

    def _lines(self, circle: CircleImages, pictures: list[Pair], index: int) -> Pair:
        """The lines of an index on both pictures of the camera sky, with gaps between the curves."""
        flat, near = [_BREAK], [_BREAK]
        for curve, (places, drawn_out) in zip(circle.curves, pictures, strict=True):
            if curve.index == index:
                flat += [self._broken(whole_line(places, curve.closed)), _BREAK]
                part = unrolled(drawn_out[:, 0], drawn_out[:, 1], curve.closed)
                # A closed curve is there at every turn already.
                for turn in (0,) if curve.closed else TURNS:
                    near += [part + np.array([turn, 0]), _BREAK]
        return np.concatenate(flat), np.concatenate(near)

    def _broken(self, line: Float[Array, "n 2"]) -> Float[Array, "m 2"]:
        """A line with gaps where it runs round the back of the camera sky; that of an Observer has none."""
        return broken(line) if self._camera.sky_unit == "rad" else line

    def _pictures(self, parts: Sequence[Float[Array, "_ axes"]]) -> list[Pair]:
        """Places on both pictures of the camera sky; all at once, as the distance to the edge takes its time."""
        sky, ends = np.concatenate(parts), np.cumsum([0, *map(len, parts)])
        pictures = azimuthal_equidistant(sky, self._view), unrolled_places(sky, self._view, self._edge)
        return [(pictures[0][i:j], pictures[1][i:j]) for i, j in pairwise(ends)]

    def _draw_curves(self, caustics: CausticSet) -> None:
        """Draw shadow, critical curves and caustics, and name the axes."""
        sky, near, sphere = self._panels
        outline = azimuthal_equidistant(self._edge, self._view)
        sky.fill(*outline.T, **style.SHADOW)
        extents, distances = [np.abs(outline).max()], []
        for caustic in caustics:
            line = {"linewidth": 0.9, "zorder": 1.6, **style.order_line(caustic.order)}
            flat = critical_line(caustic, self._view)
            drawn_out = unrolled_curve(caustic.sky, self._view, self._edge, caustic.closed)
            sky.plot(*flat.T, label=f"{style.order_name(caustic.order)} critical curve and caustic", **line)
            near.plot(*drawn_out.T, **line)
            draw_wrapped(sphere, caustic, 0.9, 0.5)
            extents.append(np.abs(flat).max())
            distances.append(drawn_out[:, 1])
        unit = self._camera.sky_unit
        limit = min(max(90.0, 1.1 * max(extents)), 180.0) if unit == "rad" else 1.5 * max(extents)
        sky.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal")
        camera_sky_axes(sky, style.tick_step(2 * limit, 7), unit)
        lowest = np.nanmin(np.concatenate([[limit / 10], *distances]))
        style.log_axis(near, lowest / 2, 1.2 * limit, ticks=9)
        unrolled_axes(near, unit)
        celestial_sphere_axes(sphere, step=45)


def _line(ax: Axes, index: int, **settings: Any) -> Line2D:
    """An empty line for images of an index, or for dots on them."""
    look = {"linestyle": "none", "color": style.index_colour(index)} if settings else style.index_line(index)
    (line,) = ax.plot([], [], **{"linewidth": 1.0, "zorder": 2.5 + bool(settings), **look, **settings})
    return line


def _on_sphere(circle: CircleImages) -> Float[Array, "n 2"]:
    """Line of the circle itself on axes of the whole sphere, degrees."""
    place = Circle.great(*circle.normal).place(np.linspace(0, 2 * math.pi, _CIRCLE_POINTS))
    phi = np.unwrap(np.arctan2(place[:, 1], place[:, 0]))
    return wrapped(np.degrees(np.stack([polar_angle(place), phi], axis=-1)))


def lines_of_counts(caustics: CausticSet) -> dict[str, Line]:
    """Lines along which the images of a great circle are counted, for a camera on the equator.

    The one at the left edge runs out from the prograde edge of the shadow, as far as the direction opposite to the
    hole; those above and below leave the shadow straight above and below its middle, and end beyond the primary curve.
    """
    edge = shadow_edge(caustics.camera, _EDGE_POINTS)
    view = view_axes(caustics.camera, edge)
    lines: dict[str, Line] = {"left edge": 0.0}
    for name, angle in (("above", 90.0), ("below", 270.0)):
        inner, last, first = (_reach(sky, view, angle) for sky in (edge, caustics[-1].sky, caustics[0].sky))
        away = np.radians([[(inner + last) / 2], [1.05 * first]])
        lines[name] = np.cos(away) * view[0] + np.sin(away) * view[2] * np.sign(180 - angle)
    return lines


def _reach(sky: Float[Array, "n 3"], view: Float[Array, "3 3"], angle: float) -> float:
    """Degrees from the shadow's middle to a curve round it at a position angle."""
    away = np.hypot(*azimuthal_equidistant(sky, view).T)
    here = position_angle(sky, view)
    order = np.argsort(here)
    return float(np.interp(angle, here[order], away[order], period=360.0))


def circle_figure(
    circle: CircleImages, caustics: CausticSet, lines: Mapping[float, LineCrossings] = MappingProxyType({})
) -> Figure:
    """Figure of the images of a great circle, 7 inches wide: camera sky, the same unrolled, circle and caustics.

    Parameters
    ----------
    circle : CircleImages
    caustics : CausticSet
        Of the same camera and surface, orders to max_index + 1.
    lines : mapping, optional
        Crossings by the edge phase (radians) of the line that was counted: dots, on a dashed line.

    Returns
    -------
    Figure
        Save it with `figure.savefig`. Its title says whether curves and counts are certified.
    """
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 6.6), layout="constrained")
        grid = figure.add_gridspec(2, 2, height_ratios=[1.35, 1])
        sky, near, sphere = (figure.add_subplot(place) for place in (grid[0, 0], grid[1, :], grid[0, 1]))
        panels = CirclePanels((sky, near, sphere), caustics, circle.max_index)
        panels.show(circle, [*lines.values()])
        for edge_phase in lines:
            panels.show_line(circle, edge_phase)
        sky.set_title("images on the camera sky")
        near.set_title("the same, unrolled at the shadow edge")
        sphere.set_title("the circle among the caustics")
        figure.legend(handles=_handles(caustics, circle.max_index), loc="outside lower center", ncols=3)
        counts = (counts_in_words(f"the line at {math.degrees(turn):.6g} deg", lines[turn]) for turn in lines)
        figure.suptitle("\n".join((_name(circle), headline(caustics), *counts)))
    return figure


def counts_in_words(where: str, crossings: LineCrossings, lowest: int = 0) -> str:
    """Numbers of images that a line crosses, by index from the lowest on, and whether they are certified."""
    counts = ", ".join(f"{count} of index {k}" for k, count in crossings.per_index.items() if k >= lowest)
    return f"{where}: {counts}{_doubt(crossings.certified)}"


def _doubt(certified: bool) -> str:
    return "" if certified else " (NOT certified)"


def _name(circle: CircleImages) -> str:
    """The circle, and whether its curves are certified."""
    theta, phi = (style.number(math.degrees(angle), ".6g") for angle in circle.normal)
    return f"great circle with its normal at θ′ = {theta} deg, φ′ = {phi} deg{_doubt(circle.certified)}"


def _handles(caustics: CausticSet, max_index: int) -> list[Line2D]:
    """The legend: curves, images, and the circle itself."""
    orders = [caustic.order for caustic in caustics]
    curves = [Line2D([], [], label=f"{style.order_name(k)} curve", **style.order_line(k)) for k in orders]
    images = [Line2D([], [], label=f"images of index {k}", **style.index_line(k)) for k in range(max_index + 1)]
    return [*curves, *images, Line2D([], [], label="the circle", **_CIRCLE)]


class CircleOrbit:
    """Orbit of a camera, frame by frame: the images of a great circle that rests on the celestial sphere.

    Seen from the camera the circle turns backward about the spin axis. Its images, and their crossings with the lines
    of `lines_of_counts`, are computed and certified anew for each frame.

    Attributes
    ----------
    times : (frames,) array
        Coordinate time of each frame; at 0 the normal is where it was given.
    figure : Figure
        As the last frame drew it.
    """

    def __init__(self, camera: Camera, normal: tuple[float, float], max_index: int, frames: int) -> None:
        """Draw what stands still. normal: (theta', phi') at the first frame, radians."""
        self._camera, self._normal, self._max_index = camera, normal, max_index
        self._speed = camera.orbital_velocity()
        self.times = np.arange(frames) / frames * 2 * math.pi / abs(self._speed)
        caustics = caustics_of(camera, max_index + 1)
        with rc_context(style.FILM_RC):
            self.figure = blank_frame()
            axes = self._axes()
            self._panels = CirclePanels(axes, caustics, max_index)
            first = circle_images(camera, normal, max_index)
            self._lines = lines_of_counts(caustics)
            for line in self._lines.values():
                self._panels.show_line(first, line)
            self._words(axes, caustics)
            self._backdrop = Backdrop(self.figure, [*self._panels.moving, self._caption])

    def frame(self, number: int) -> UInt8[Array, "height width 3"]:
        """The picture (height, width, 3) of a frame."""
        time = float(self.times[number])
        theta, phi = self._normal
        circle = circle_images(self._camera, (theta, phi - self._speed * time), self._max_index)
        lines = {name: crossings_of_line(circle, line) for name, line in self._lines.items()}
        with rc_context(style.FILM_RC):
            self._panels.show(circle, [*lines.values()])
            self._caption.set_text(self.caption(time, circle, lines))
            return self._backdrop.pixels()

    def caption(self, time: float, circle: CircleImages, lines: Mapping[str, LineCrossings]) -> str:
        """Time, and how many images are at the flat edge, above the shadow and below it."""
        certified = circle.certified and all(line.certified for line in lines.values())
        verdict = "certified" if certified else f"NOT certified ({_why(circle, lines)})"
        counts = (counts_in_words(name, line, name != "left edge") for name, line in lines.items())
        return "\n".join((f"t = {time:.1f} M. Images on the dashed lines, {verdict}:", *counts))

    def _axes(self) -> tuple[Axes, Axes, Axes]:
        sky = self.figure.add_axes((0.065, 0.225, 0.425, 0.69))
        near = self.figure.add_axes((0.575, 0.515, 0.40, 0.40))
        sphere = self.figure.add_axes((0.575, 0.225, 0.40, 0.175))
        return sky, near, sphere

    def _words(self, axes: tuple[Axes, Axes, Axes], caustics: CausticSet) -> None:
        """Titles, legend and the place of the caption."""
        sky, near, sphere = axes
        sky.set_title("images of the circle, as the camera sees them")
        near.set_title("the same, near the shadow (its edge is at the bottom)")
        sphere.set_title("the circle and the caustics on the celestial sphere")
        sphere.set_xlabel(seen_from_outside("φ′ from the camera (deg)"))
        tilt = f"great circle {math.degrees(self._normal[0]):.6g} deg from the equatorial plane; "
        self.figure.text(0.5, 0.993, tilt + headline(caustics), ha="center", va="top")
        place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (0.555, 0.145)}
        self.figure.legend(handles=_handles(caustics, self._max_index), ncols=2, **place)
        self._caption = self.figure.text(0.03, 0.135, "", fontsize=12.5, va="top", linespacing=1.35)


def _why(circle: CircleImages, lines: Mapping[str, LineCrossings]) -> str:
    """The first remark."""
    remarks = [*circle.remarks, *(remark for line in lines.values() for remark in line.remarks)]
    return remarks[0] if remarks else ""


def circle_film(
    camera: Camera, normal: tuple[float, float], max_index: int = 2, frames: int = 240, rate: int = 24
) -> Film:
    """The film of one orbit of a camera, with the images of a great circle of the celestial sphere.

    Parameters
    ----------
    camera : Camera
        On a circular orbit about the spin axis.
    normal : (theta', phi')
        Of the circle at the first frame, radians.
    max_index : int
        Images of index 0 to max_index.
    frames, rate : int
        How many, and how many a second.
    """
    settings = {**camera_settings(camera), "theta": normal[0], "phi": normal[1], "max_index": max_index}
    return Film("great circle", settings, frames, rate, CircleOrbit(camera, normal, max_index, frames).frame)
