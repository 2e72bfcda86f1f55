"""Plots of results on the camera sky and on the surface of the sources.

On the camera sky all have one zero, the middle of the shadow. Images, tracks and events bring the curves that explain
them, unless the axes hold something already.
"""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from kerrcaustics.beams.beam import Rays
from kerrcaustics.beams.ends import SKY
from kerrcaustics.curves.caustic import Caustic, CausticSet, Cusp
from kerrcaustics.curves.caustic_search import caustics as caustics_of
from kerrcaustics.draw import style
from kerrcaustics.draw.count_map import count_map_axes
from kerrcaustics.draw.plots import celestial_sphere, is_small, primary_zoom
from kerrcaustics.draw.projection import about_shadow, azimuthal_equidistant, broken, whole_line
from kerrcaustics.draw.sky_axes import (
    caustics_on_sphere,
    draw_from_above,
    draw_places,
    draw_totals,
    from_above,
    is_shapeless,
    is_sphere,
    name_sky_axes,
    sky_length,
    source_axes,
)
from kerrcaustics.draw.titles import viewer_in_words
from kerrcaustics.draw.tracks import stretches, tracks_legend, tracks_on_sky
from kerrcaustics.images.counts import CountMap, ImageCounts
from kerrcaustics.images.images import StarImages
from kerrcaustics.interop.physical_scale import checked_scale
from kerrcaustics.light_curves.results import SourceEvent, SpotEvent
from kerrcaustics.scenes.footprint import Footprint
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.spacetime.sphere import polar_angle
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.circles import CircleCurve, CircleImages
from kerrcaustics.tracks.events import PairEvent, PairEvents
from kerrcaustics.tracks.following import FollowedStar
from kerrcaustics.tracks.isoradials import Isoradial
from kerrcaustics.tracks.lines import LineCrossings
from kerrcaustics.tracks.tracks import StarTracks, Track

Array = np.ndarray

_EDGE_POINTS = 720
# So many times as far out as the shadow and the critical curves, images no longer set the scale.
_FAR = 2.0
# Rows: against e_x, along e_y, along e_z.
_BASIS = np.diag([-1.0, 1.0, 1.0])
# x and y of the corners of a picture, the first of them twice, in parts of its width and height.
# Words of a legend can be read where a curve runs behind them.
_LEGEND: dict[str, Any] = {
    "loc": "best", "fontsize": "small", "handlelength": 1.5, "frameon": True, "framealpha": 0.85, "edgecolor": "none"
}  # fmt: skip
_CORNERS = [[0, 1, 1, 0, 0], [0, 0, 1, 1, 0]]


def one_caustic(ax: Axes, caustic: Caustic, *, zoom: bool | None = None) -> Axes:
    """The caustic, its cusps lettered; with `zoom` (usual below 10 degrees on a sphere), in its true shape."""
    if is_sphere(caustic.surface):
        zoom = is_small(caustic) if zoom is None else zoom
        draw = primary_zoom if zoom and not is_shapeless(caustic) else celestial_sphere
        draw(ax, caustic)
    else:
        draw_from_above(from_above(ax), caustic)
    ax.set_title(f"{style.order_name(caustic.order)} caustic\n{viewer_in_words(caustic.camera)}")
    return ax


def caustic_set(ax: Axes, caustics: CausticSet, *, sky: str = "celestial") -> Axes:
    """The caustics on their surface, none of them torn; `sky="camera"`: the critical curves round the shadow."""
    if sky not in ("celestial", "camera"):
        raise ValueError(f"Argument `sky` must be celestial or camera, but is {sky!r}.")
    if sky == "camera":
        shadow(ax, caustics.camera)
        critical_curves(ax, caustics)
    else:
        caustics_on_surface(ax, caustics)
    return labelled_once(ax)


def caustics_on_surface(ax: Axes, caustics: CausticSet) -> Axes:
    """Caustics on their surface, none of them torn."""
    if is_sphere(caustics.surface):
        return caustics_on_sphere(ax, caustics)
    for caustic in caustics:
        draw_from_above(ax, caustic, label=style.order_name(caustic.order))
    return from_above(ax)


def critical_curves(ax: Axes, caustics: CausticSet) -> None:
    """Critical curves on the camera sky, one colour an order."""
    for caustic in caustics:
        line = style.order_line(caustic.order)
        curve = whole_line(caustic.sky, caustic.closed)
        _on_sky(ax, caustics.camera, curve, label=f"{style.order_name(caustic.order)} critical curve", **line)


def cusp_place(ax: Axes, cusp: Cusp) -> Axes:
    """The cusp on the celestial sphere."""
    return draw_places(ax, SKY, cusp.celestial[None], marker="o")


def event_places(ax: Axes, events: PairEvents) -> Axes:
    """Places of the source at creations (up) and annihilations (down), one colour an order, on the caustics."""
    if events and not ax.has_data():
        caustics_on_surface(ax, caustics_of(events.camera, max(event.order for event in events), end=events.surface))
    for event in events:
        one_event(ax, event)
    return labelled_once(source_axes(ax, events.surface))


def one_event(ax: Axes, event: PairEvent) -> Axes:
    """The place of the source, relative to the camera, at the event; in the plane, seen from above."""
    mark = {**style.event_mark(event.kind), "markeredgecolor": style.order_colour(event.order)}
    label = f"{event.kind}, order {event.order}"
    return labelled_once(draw_places(ax, event.surface, np.array([event.star]), label=label, **mark))


def ray_ends(ax: Axes, rays: Rays) -> Axes:
    """Ends of rays, theta' and phi'; those of rays that do not escape are left out."""
    ends = rays.direction.reshape(-1, 3)[rays.escaped.ravel()]
    return draw_places(ax, SKY, _angles(ends), marker=".", markersize=3)


def footprint_places(ax: Axes, footprint: Footprint) -> Axes:
    """Places on the celestial sphere that the pixels show."""
    return draw_places(ax, SKY, _angles(footprint.direction), marker=".", markersize=3)


def count_map(ax: Axes, counts: CountMap, *, caustics: CausticSet | tuple[Caustic, ...] = ()) -> Axes:
    """Totals over the surface, one colour a count; over a sphere with `caustics` of the same camera."""
    if is_sphere(counts.surface):
        return count_map_axes(ax, counts, caustics)
    places = np.stack(np.meshgrid(counts.level, counts.phi, indexing="ij"), axis=-1).reshape(-1, 2)
    return draw_totals(ax, counts.surface, places, counts.counts.sum(axis=2).ravel())


def star_counts(ax: Axes, counts: ImageCounts) -> Axes:
    """The sources, coloured by how many images each has."""
    return draw_totals(ax, counts.surface, counts.stars, counts.total)


def image_places(ax: Axes, images: StarImages, *, caustics: CausticSet | None = None, scale: object = None) -> Axes:
    """Images on the camera sky, with shadow and critical curves: a colour for each index, larger where brighter.

    An image far out, twice as far as the farthest critical curve, is an arrow at the rim, with its distance.

    `caustics`: of the same camera and surface, where they are known; `scale`: a `PhysicalScale` with a distance, for
    an observer's sky in microarcseconds.
    """
    units = checked_scale(scale)
    places, reach = about_shadow(images.camera, images.sky), math.inf
    if not ax.has_data():
        shadow(ax, images.camera)
        curves = caustics or caustics_of(images.camera, images.max_index + 1, end=images.surface)
        critical_curves(ax, curves)
        reach = _FAR * np.abs([ax.dataLim.min, ax.dataLim.max]).max()
    far = np.hypot(*places.T) > reach
    brightness = np.nan_to_num(images.magnification, nan=0.0, posinf=1e9)
    size = 6 + 5 * np.log10(np.clip(brightness / max(brightness.max(initial=0), 1e-300), 1e-4, 1)) / 4
    indices = images.index.tolist()
    for i, (place, k, large) in enumerate(zip(places, indices, size.tolist(), strict=True)):
        mark = {"marker": "o", "markersize": large, "color": style.index_colour(k), "zorder": 2.5, "linestyle": "none"}
        label = {"label": f"index {k}"} if k not in indices[:i] else {}
        ax.plot(*np.where(far[i], np.nan, place)[:, None], **label, **mark)
    for i in np.flatnonzero(far):
        _point_out_far(ax, places[i], style.index_colour(indices[i]), sky_length(images.camera, units))
    if units is not None:
        name_sky_axes(ax, images.camera.sky_unit, units)
    return labelled_once(ax, **legend_beside(ax))


def _point_out_far(ax: Axes, place: Float[Array, "2"], colour: str, unit: tuple[str, float]) -> None:
    """An arrow at the rim of the axes toward a place beyond them, and how far from their zero it is."""
    distance = unit[1] * float(np.hypot(*place))
    ends = np.where(place > 0, [ax.get_xlim()[1], ax.get_ylim()[1]], [ax.get_xlim()[0], ax.get_ylim()[0]])
    tip = 0.97 * place * float(np.min(ends / np.where(place == 0, 1e-12, place)))
    arrow = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.4, "shrinkA": 2, "shrinkB": 0}
    text: dict[str, Any] = {"ha": "left" if tip[0] < 0 else "right", "va": "bottom" if tip[1] < 0 else "top"}
    text |= {"color": colour, "path_effects": [withStroke(linewidth=3, foreground="white")]}
    ax.annotate(f"at {distance:.3g} {unit[0]}", tuple(tip), tuple(0.8 * tip), arrowprops=arrow, **text)


def followed_images(ax: Axes, star: FollowedStar) -> Axes:
    """The images at all cameras, darker from camera to camera, with the last camera's shadow."""
    if star.images and not ax.has_data():
        shadow(ax, star.images[-1].camera)
        ax.set_title(f"the last of {len(star)} viewers:\n{viewer_in_words(star.images[-1].camera)}")
    for part, images in zip(np.linspace(0.15, 1, len(star.images)).tolist(), star.images, strict=True):
        mark = {"linestyle": "none", "marker": "o", "markersize": 3, "color": "black", "alpha": part}
        _on_sky(ax, images.camera, images.sky, **mark)
    return ax


def one_track(ax: Axes, track: Track) -> Axes:
    """Draw a track on the camera sky, with a colour for each index."""
    for k, which in stretches(track):
        _on_sky(ax, track.camera, track.sky[which], label=f"index {k}", **style.index_line(k))
    for event in track.events:
        _on_sky(ax, track.camera, event.sky[None], **style.event_mark(event.kind))
    return labelled_once(ax)


def all_tracks(ax: Axes, tracks: StarTracks) -> Axes:
    """All tracks, with shadow and critical curves; triangles are creations (up) and annihilations (down)."""
    bare = not ax.has_data()
    curves = caustics_of(tracks.camera, tracks.max_index + 1, end=tracks.surface) if bare else ()
    tracks_on_sky(ax, tracks, curves, shadow_edge(tracks.camera, _EDGE_POINTS))
    ax.legend(handles=tracks_legend([tracks], bool(curves)), **{**_LEGEND, **legend_beside(ax)})
    return ax


def circle_curve(ax: Axes, curve: CircleCurve) -> Axes:
    """Draw the image of a circle on the camera sky."""
    line, unit = about_shadow(curve.camera, whole_line(curve.sky, curve.closed)), curve.camera.sky_unit
    ax.plot(*(broken(line) if unit == "rad" else line).T, label=f"index {curve.index}", **style.index_line(curve.index))
    return name_sky_axes(ax, unit)


def circle_curves(ax: Axes, circle: CircleImages, *, caustics: CausticSet | None = None) -> Axes:
    """The images of the great circle, one colour an index, with shadow and critical curves.

    `caustics`: of the same camera and surface, where they are known.
    """
    if not ax.has_data():
        shadow(ax, circle.camera)
        curves = caustics or caustics_of(circle.camera, circle.max_index + 1, end=circle.surface)
        critical_curves(ax, curves)
    for curve in circle.curves:
        circle_curve(ax, curve)
    return labelled_once(ax)


def line_crossings(ax: Axes, crossings: LineCrossings) -> Axes:
    """Draw crossings of a line on the camera sky, with a colour for each index."""
    for sky, k in zip(crossings.sky, crossings.index.tolist(), strict=True):
        mark = {"linestyle": "none", "marker": "o", "markersize": 3, "color": style.index_colour(k)}
        _on_sky(ax, crossings.camera, sky[None], label=f"index {k}", **mark)
    return labelled_once(ax)


def isoradial(ax: Axes, curve: Isoradial) -> Axes:
    """The curve on the camera sky."""
    return isoradials(ax, [curve])


def isoradials(ax: Axes, curves: Iterable[Isoradial]) -> Axes:
    """The images of circles round the hole, one colour a crossing of the plane."""
    for curve in curves:
        line, name = style.crossing_line(curve.crossing), f"crossing {curve.crossing}"
        _on_sky(ax, curve.camera, whole_line(curve.sky, curve.closed), label=name, **line)
    return labelled_once(ax)


def spot_event(ax: Axes, event: SpotEvent | SourceEvent) -> Axes:
    """The place of the event on the camera sky."""
    return _on_sky(ax, event.camera, event.sky[None], **style.event_mark(event.kind))


def shadow(ax: Axes, camera: Viewer) -> Axes:
    """The shadow of the hole."""
    outline = about_shadow(camera, shadow_edge(camera, _EDGE_POINTS))
    ax.fill(*outline.T, label="shadow", **style.SHADOW)
    return name_sky_axes(ax, camera.sky_unit)


def picture_border(ax: Axes, view: Raster, *, camera: Viewer | None = None) -> Axes:
    """The border of the picture on the sky of `camera`, with the shadow; on no viewer's, about the direction -e_x."""
    turn, last = np.linspace(0, 4, 801), np.array([view.width, view.height]) - 0.5
    x, y = (
        np.interp(turn, range(5), np.where(corners, end, -0.5)) for corners, end in zip(_CORNERS, last, strict=True)
    )
    sky = view.places(x, y)
    if camera is not None:
        shadow(ax, camera)
    places = azimuthal_equidistant(sky, _BASIS) if camera is None else about_shadow(camera, sky)
    if sky.shape[-1] == 3:
        # Through the direction away from the middle, which is a whole circle here, no line is drawn.
        places[1:][np.linalg.norm(np.diff(places, axis=0), axis=1) > 90] = np.nan
    ax.plot(*places.T, color="black", label="border of the picture")
    name_sky_axes(ax, "rad" if sky.shape[-1] == 3 else "")
    if camera is None and sky.shape[-1] == 3:
        ax.set(xlabel="right of −e_x (deg)", ylabel="above −e_x (deg)")
    return ax


def _on_sky(ax: Axes, camera: Viewer, sky: Float[Array, "n k"], **settings: Any) -> Axes:
    """A line, or points, on the camera sky."""
    ax.plot(*about_shadow(camera, sky).T, **settings)
    return name_sky_axes(ax, camera.sky_unit)


def labelled_once(ax: Axes, **legend: Any) -> Axes:
    """Add a legend with every label once; legend: its settings."""
    handles, labels = ax.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    if once:
        ax.legend(once.values(), once.keys(), **{**_LEGEND, **legend})
    return ax


def legend_beside(ax: Axes) -> dict[str, Any]:
    """Settings of a legend to the right of axes that are alone in a figure which makes room for it; else none."""
    figure: Any = ax.figure
    alone = len(figure.axes) == 1 and getattr(figure, "get_layout_engine", lambda: None)()
    return {"loc": "upper left", "bbox_to_anchor": (1.02, 1.0), "borderaxespad": 0.0} if alone else {}


def _angles(direction: Float[Array, "n 3"]) -> Float[Array, "n 2"]:
    """(theta', phi') of unit vectors."""
    return np.stack([polar_angle(direction), np.arctan2(direction[:, 1], direction[:, 0])], axis=-1)
