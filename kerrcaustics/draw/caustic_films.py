"""Frames about caustics: how they change from camera to camera, and which point of a caustic is seen where."""

import math
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from kerrcaustics.curves.caustic import Caustic, CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.films import Backdrop, blank_frame, pixels
from kerrcaustics.draw.plots import camera_sky, celestial_sphere
from kerrcaustics.draw.projection import azimuthal_equidistant, view_axes
from kerrcaustics.draw.sky_axes import (
    camera_sky_axes,
    celestial_sphere_axes,
    critical_line,
    draw_wrapped,
    is_shapeless,
)
from kerrcaustics.draw.titles import headline
from kerrcaustics.shapes import Float, UInt8
from kerrcaustics.spacetime.shadow import shadow_edge

Array = np.ndarray

_EDGE_POINTS = 2000
# Degrees of camera sky on each side of the middle.
_REACH = 110.0
# Length of the trail behind a moving point, in parts of the curve.
_TRAIL = 0.06
# Caustics of fewer degrees than this are looked at closely.
_SMALL = 10.0
# The same number of digits while the camera moves.
_RADIUS = ".2f"


def caustics_frame(caustics: CausticSet, text: str) -> UInt8[Array, "height width 3"]:
    """Return a picture (height, width, 3): the camera sky beside the celestial sphere, the same axes for every camera.

    Parameters
    ----------
    caustics : CausticSet
    text : str
        What is to be seen, a line or two, at the bottom.
    """
    with rc_context(style.FILM_RC):
        figure = blank_frame()
        edge = shadow_edge(caustics.camera, _EDGE_POINTS)
        _sky_panel(figure.add_axes((0.065, 0.205, 0.425, 0.71)), caustics, edge)
        _sphere_panel(figure.add_axes((0.575, 0.37, 0.40, 0.545)), caustics)
        handles = [
            Line2D([], [], label=_extent(caustic), linewidth=1.6, **style.order_line(caustic.order))
            for caustic in caustics
        ]
        figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.57, 0.265), fontsize=11.5, labelspacing=0.6)
        figure.text(0.5, 0.993, headline(caustics, _RADIUS), ha="center", va="top")
        figure.text(0.03, 0.1, text, fontsize=12.5, va="top", linespacing=1.35)
        return pixels(figure)


def _extent(caustic: Caustic) -> str:
    name = f"{style.order_name(caustic.order)} caustic"
    if is_shapeless(caustic):
        return f"{name}: {'a point' if caustic.kind == 'point' else 'unresolved'}"
    theta, phi = (_rounded(math.degrees(extent)) for extent in (caustic.theta_extent, caustic.phi_extent))
    return f"{name}: {theta}° high, {phi}° long"


def _rounded(value: float) -> str:
    """Three digits, without an exponent."""
    return f"{value:.{max(0, 2 - math.floor(math.log10(value)))}f}"


def _sky_panel(ax: Axes, caustics: CausticSet, edge: Float[Array, "n 3"]) -> None:
    view = view_axes(caustics.camera, edge)
    ax.fill(*azimuthal_equidistant(edge, view).T, **style.SHADOW)
    for caustic in caustics:
        ax.plot(*critical_line(caustic, view).T, **style.order_line(caustic.order))
    ax.set(xlim=(-_REACH, _REACH), ylim=(-_REACH, _REACH), aspect="equal")
    ax.set_title("camera sky: shadow and critical curves")
    camera_sky_axes(ax, 30)


def _sphere_panel(ax: Axes, caustics: CausticSet) -> None:
    for caustic in reversed(caustics):
        draw_wrapped(ax, caustic, 1.3, 0.6)
    celestial_sphere_axes(ax, "φ′ from the camera (deg)")
    ax.set_title("celestial sphere: caustics")


class Mapping:
    """A point that runs along each critical curve, and the point of the caustic that is seen there."""

    def __init__(self, caustics: CausticSet) -> None:
        """Panels, letters and moving points; orders 1 to 3 at most."""
        self.caustics = caustics
        self._places = [_even_places(caustic) for caustic in caustics]
        edge = shadow_edge(caustics.camera, _EDGE_POINTS)
        self._view = view_axes(caustics.camera, edge)
        with rc_context(style.FILM_RC):
            self.figure = blank_frame()
            sky = camera_sky(self.figure.add_axes((0.065, 0.13, 0.42, 0.8)), caustics, edge)
            sky.set_aspect("equal", adjustable="box")
            sky.set_title("critical curves, as the camera sees them")
            panels = [self._panel(i, caustic) for i, caustic in enumerate(caustics)]
            self._movers = [
                (_mover(sky, caustic.order), _mover(panel, caustic.order))
                for caustic, panel in zip(caustics, panels, strict=True)
            ]
            self.figure.text(0.03, 0.03, headline(caustics), fontsize=12)
            moving = [artist for movers in self._movers for pair in movers for artist in pair]
            self._backdrop = Backdrop(self.figure, moving)

    def _panel(self, place: int, caustic: Caustic) -> Axes:
        """The celestial sphere with one caustic, below those of lower order."""
        height = 0.8 / len(self.caustics)
        low = 0.93 - height * (place + 1) + 0.075
        ax = celestial_sphere(self.figure.add_axes((0.575, low, 0.40, height - 0.11)), caustic)
        ax.set_aspect("auto")
        _enlarge(ax, caustic)
        ax.set_title(f"{style.order_name(caustic.order)} caustic, on the celestial sphere")
        if place < len(self.caustics) - 1:
            ax.set_xlabel("")
        return ax

    def frame(self, part: float) -> UInt8[Array, "height width 3"]:
        """The picture (height, width, 3) when the points have run through this part of their curves."""
        for caustic, places, movers in zip(self.caustics, self._places, self._movers, strict=True):
            trail = np.interp(part - np.linspace(0, _TRAIL, 40), places[1], places[0], period=1.0)
            whole = np.unwrap(trail, period=len(caustic.sky))
            sky = azimuthal_equidistant(_curve_points(caustic.sky, whole), self._view)
            celestial = np.degrees(_curve_points(caustic.celestial, whole))[:, ::-1]
            for (dot, tail), line in zip(movers, (sky, celestial), strict=True):
                dot.set_data(line[:1, 0], line[:1, 1])
                tail.set_data(line[:, 0], line[:, 1])
        with rc_context(style.FILM_RC):
            return self._backdrop.pixels()


def _enlarge(ax: Axes, caustic: Caustic) -> None:
    """Look at a small caustic closely."""
    if math.degrees(max(caustic.theta_extent, caustic.phi_extent)) > _SMALL:
        return
    low, high = (np.degrees(edge(caustic.celestial, axis=0)) for edge in (np.min, np.max))
    margin = 0.35 * (high - low)
    ax.set_ylim(high[0] + margin[0], low[0] - margin[0])
    ax.set_xlim(low[1] - margin[1], high[1] + margin[1])
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(5))


def _mover(ax: Axes, order: int) -> tuple[Line2D, Line2D]:
    colour = style.order_colour(order)
    settings: dict[str, Any] = {"markerfacecolor": colour, "markeredgecolor": "black", "markersize": 10}
    (dot,) = ax.plot([], [], marker="o", linestyle="none", zorder=6, **settings)
    (tail,) = ax.plot([], [], color=colour, linewidth=4.5, alpha=0.5, zorder=5, solid_capstyle="round")
    return dot, tail


def _even_places(caustic: Caustic) -> tuple[Float[Array, " places"], Float[Array, " places"]]:
    """Numbers of the points (n + 1,), and the part of the way run at each, evenly on both spheres."""
    parts = []
    for curve in (caustic.sky, caustic.celestial):
        step = np.linalg.norm(np.diff(np.append(curve, curve[:1], axis=0), axis=0), axis=1)
        parts.append(np.concatenate([[0], np.cumsum(step)]) / step.sum())
    return np.arange(len(caustic.sky) + 1.0), (parts[0] + parts[1]) / 2


def _curve_points(curve: Float[Array, "n k"], place: Float[Array, " m"]) -> Float[Array, "m k"]:
    """Points of a closed curve (n, k) between its corners."""
    low = np.floor(place).astype(int)
    part = (place - low)[:, None]
    return (1 - part) * curve[low % len(curve)] + part * curve[(low + 1) % len(curve)]
