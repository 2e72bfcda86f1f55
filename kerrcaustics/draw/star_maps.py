"""Star tracks and critical curves over a picture of the stars, as JTFT figures 2 and 4 show them."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.patheffects import withStroke

from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.palettes import INDEX_ON_BLACK
from kerrcaustics.draw.projection import azimuthal_equidistant, view_axes
from kerrcaustics.draw.sky_axes import camera_sky_axes, critical_line
from kerrcaustics.draw.tracks import draw_motion, moving_lines
from kerrcaustics.scenes.flare import glare_kernel, with_glare
from kerrcaustics.scenes.render import render
from kerrcaustics.scenes.sky import Sky
from kerrcaustics.scenes.tones import tone_mapped
from kerrcaustics.scenes.view import View
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.tracks.tracks import StarTracks

Array = np.ndarray

CURVE_COLOUR = "#c58cff"
"""The colour of critical curves on black: violet, as in JTFT."""

DARK_RIM = withStroke(linewidth=2.5, foreground="black")
_CURVES: dict[str, Any] = {"color": CURVE_COLOUR, "linewidth": 1.2, "linestyle": (0, (5, 2))}
# What the sky's light is divided by, and how softly the brightest is cut off.
_LOOK: dict[str, Any] = {"exposure": 1 / 2500, "curve": "asinh", "softening": 25}
# A halo round each star, in pixels: the brighter a star, the farther its halo is seen.
_HALO: dict[str, Any] = {"share": 0.35, "width": 1.0, "falloff": 4.0}


def sky_behind(ax: Axes, camera: Camera, axes: Float[Array, "3 3"], reach: float, sky: Sky, pixels: int = 560) -> Axes:
    """A sky as the camera sees it, on axes of the azimuthal equidistant picture up to `reach` degrees from its centre.

    axes (3, 3): as `view_axes` returns them; pixels: rows and columns. Two corners may be at most 180 degrees apart
    from the centre: reach is below 127.
    """
    view = View(pixels, pixels, math.radians(2 * reach), "fisheye", axes[0], axes[2])
    light = with_glare(render(camera, view, sky).light, glare_kernel(**_HALO))
    picture = tone_mapped(light, **_LOOK)
    ax.imshow(picture, extent=(-reach, reach, -reach, reach), interpolation="antialiased", zorder=0)
    ax.set_facecolor("black")
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    return camera_sky_axes(ax, style.tick_step(2 * reach, 7))


def tracks_on_stars(
    ax: Axes,
    stars: Sequence[StarTracks],
    caustics: CausticSet,
    edge: Float[Array, "n 3"],
    sky: Sky,
    reach: float,
    *,
    colours: Sequence[str] = (),
) -> Float[Array, "3 3"]:
    """Tracks with arrows of motion, critical curves and shadow over a sky, to `reach` degrees; the axes (3, 3) of it.

    Tracks have one of `INDEX_ON_BLACK` each, or one of `colours` for each star; critical curves are violet and dashed.
    """
    axes, camera = view_axes(caustics.camera, edge), caustics.camera
    assert isinstance(camera, Camera)
    sky_behind(ax, camera, axes, reach, sky)
    ax.add_patch(Polygon(azimuthal_equidistant(edge, axes), facecolor="none", edgecolor="#9a9a9a", linewidth=0.7))
    for caustic in caustics:
        ax.plot(*critical_line(caustic, axes).T, scalex=False, scaley=False, **_CURVES)
    for number, star in enumerate(stars):
        for track in star.tracks:
            for index, line in moving_lines(star, track, azimuthal_equidistant(track.sky, axes)):
                colour = colours[number] if colours else style.index_colour(index, on_black=True)
                ax.plot(*line.T, color=colour, linewidth=0.8, scalex=False, scaley=False)
                draw_motion(ax, line, colour, spacing=0.35)
    return axes


def star_map_legend(max_index: int) -> list[Line2D]:
    """Handles for a legend of `tracks_on_stars`, drawn for a white page."""
    names = [f"{style.order_name(k + 1)} images (index {k})" for k in range(3)] + ["images of index 3"]
    pairs = zip(names[: max_index + 1], INDEX_ON_BLACK, strict=False)
    lines = [Line2D([], [], color=colour, linewidth=2, label=name) for name, colour in pairs]
    return [*lines, curve_handle("critical curves")]


def curve_handle(name: str) -> Line2D:
    """The handle of critical curves for a legend."""
    return Line2D([], [], label=name, **{**_CURVES, "linewidth": 1.6})
