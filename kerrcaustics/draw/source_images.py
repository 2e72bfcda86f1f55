"""Images of a source of finite size: their shapes among the critical curves, and the source among the caustics."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from kerrcaustics.curves.caustic import Caustic, CausticSet
from kerrcaustics.curves.caustic_search import caustics as caustics_of
from kerrcaustics.draw import style
from kerrcaustics.draw.image_figure import sky_and_source
from kerrcaustics.draw.palettes import STAR_COLOUR
from kerrcaustics.draw.projection import about_shadow, whole_line
from kerrcaustics.draw.sky_results import critical_curves, labelled_once, legend_beside, shadow
from kerrcaustics.extended_sources.magnification import LimbImage, Magnification
from kerrcaustics.lens_map.domains import domain_of
from kerrcaustics.results.units import magnification_unit
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.sphere import polar_angle
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_LIMB_POINTS = 181
_LIMB: dict[str, Any] = {"color": STAR_COLOUR, "marker": "o", "markersize": 1.8, "markeredgewidth": 0, "zorder": 3}
_FILL: dict[str, Any] = {"facecolor": STAR_COLOUR, "alpha": 0.5, "edgecolor": "none", "zorder": 2.4}


def limb_image(ax: Axes, image: LimbImage) -> Axes:
    """The curve on the camera sky, one colour an index."""
    places = about_shadow(image.camera, whole_line(image.sky, True))
    index = np.append(image.index, image.index[:1])
    for k in np.unique(index).tolist():
        line = {"linewidth": 1.0, "zorder": 2.5, **style.index_line(k)}
        ax.plot(*_where(places, index == k).T, label=f"index {k}", **line)
    return labelled_once(ax)


def source_images(ax: Axes, magnification: Magnification, *, caustics: CausticSet | None = None) -> Axes:
    """The images of the source, filled, with their limbs in one colour an index, shadow and critical curves.

    `caustics`: of the same camera and surface, where they are known.
    """
    if not ax.has_data():
        shadow(ax, magnification.camera)
        critical_curves(
            ax, caustics or caustics_of(magnification.camera, magnification.max_index + 1, end=magnification.surface)
        )
    loops = [about_shadow(magnification.camera, image.sky) for image in magnification.images]
    # Curves have the image to their left, those of holes run the other way: what lies within both is left open.
    if loops:
        path = Path.make_compound_path(*(Path(whole_line(loop, True)) for loop in loops))
        ax.add_patch(PathPatch(path, **_FILL))
    for image in magnification.images:
        limb_image(ax, image)
    return labelled_once(ax, **legend_beside(ax))


def unrolled_images(ax: Axes, magnification: Magnification, critical: Caustic, middle: Float[Array, " axes"]) -> Axes:
    """Images that have parts next to a critical curve, filled: the curve is the line 0, and lengths across it are free.

    To the right the position angle from the direction `middle`, up the distance outward from the curve, degrees.
    """
    camera = magnification.camera
    curve = _turn_and_distance(camera, critical.sky)
    curve = curve[np.argsort(curve[:, 0])]
    zero = _turn_and_distance(camera, middle[None])[0, 0]
    ax.axhline(0, **style.order_line(critical.order))
    for image in magnification.images:
        index = np.append(image.index, image.index[:1])
        if not np.isin(index, (critical.order - 1, critical.order)).all():
            continue
        turn, distance = _turn_and_distance(camera, whole_line(image.sky, True)).T
        places = np.stack([(turn - zero + 180) % 360 - 180, distance - np.interp(turn, *curve.T, period=360)], axis=-1)
        ax.fill(*places.T, **_FILL)
        for k in np.unique(index).tolist():
            ax.plot(*_where(places, index == k).T, **style.index_line(k))
    return ax


def _turn_and_distance(camera: Viewer, sky: Float[Array, "points axes"]) -> Float[Array, "points 2"]:
    """Position angle and distance from the middle of the shadow, degrees."""
    x, y = about_shadow(camera, sky).T
    return np.stack([np.degrees(np.arctan2(y, x)), np.hypot(x, y)], axis=-1)


def source_images_figure(magnification: Magnification) -> Figure:
    """Figure of a source of finite size, 7 inches wide: its images, and the source among the caustics."""
    caustics = caustics_of(magnification.camera, magnification.max_index + 1, end=magnification.surface)
    source = _limb_places(magnification), {"label": "limb of the source", **_LIMB}
    unit = magnification_unit(magnification).replace("^2", "²")
    brightness = (
        f": magnification {magnification.total:.6g} {unit}" if unit else f": {magnification.total:.6g} times as bright"
    )
    return sky_and_source(
        lambda ax: source_images(ax, magnification, caustics=caustics),
        caustics,
        magnification.source,
        source,
        brightness,
    )


def _limb_places(magnification: Magnification) -> Float[Array, "points 2"]:
    """Coordinates of points of the limb on the surface of the source."""
    centre = magnification.surface.vectors(np.array([magnification.source]))[0]
    domain = domain_of(magnification.surface, magnification.camera)
    size, turn = magnification.size / domain.radian_length, np.linspace(0, 2 * np.pi, _LIMB_POINTS)
    if len(centre) == 2:
        limb = centre + size * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        return np.stack([np.hypot(*limb.T), np.unwrap(np.arctan2(limb[:, 1], limb[:, 0]))], axis=-1)
    limb = Circle.from_centre(centre, size).place(turn)
    phi = np.unwrap(np.arctan2(limb[:, 1], limb[:, 0]))
    return np.stack([polar_angle(limb), phi], axis=-1)


def _where(line: Float[Array, "points 2"], kept: Bool[Array, " points"]) -> Float[Array, "points 2"]:
    """A line with gaps between points of which none is kept."""
    beside = kept | np.append(kept[1:], False) | np.insert(kept[:-1], 0, False)
    return np.where(beside[:, None], line, np.nan)
