"""Plots of results on the camera sky and on the celestial sphere."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes

from kerrcaustics.beams.beam import Rays
from kerrcaustics.beams.ends import SKY, End
from kerrcaustics.curves.caustic import Caustic, CausticSet, Cusp
from kerrcaustics.draw import style
from kerrcaustics.draw.count_map import count_map_axes
from kerrcaustics.draw.plots import celestial_sphere, is_small, primary_zoom
from kerrcaustics.draw.projection import about_hole, whole_line
from kerrcaustics.draw.sky_axes import (
    celestial_sphere_axes,
    draw_from_above,
    draw_places,
    draw_totals,
    draw_wrapped,
    from_above,
    is_sphere,
    name_sky_axes,
    on_axes,
    source_axes,
)
from kerrcaustics.draw.tracks import stretches
from kerrcaustics.images.counts import CountMap, ImageCounts
from kerrcaustics.images.images import StarImages
from kerrcaustics.scenes.catalogue import StarCatalogue
from kerrcaustics.scenes.footprint import Footprint
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.star_field import StarField
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.spacetime.sphere import polar_angle
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.circles import CircleCurve, CircleImages
from kerrcaustics.tracks.events import PairEvent
from kerrcaustics.tracks.following import FollowedStar
from kerrcaustics.tracks.isoradials import Isoradial
from kerrcaustics.tracks.light_curves import SpotEvent
from kerrcaustics.tracks.lines import LineCrossings
from kerrcaustics.tracks.tracks import StarTracks, Track

Array = np.ndarray

# x and y of the corners of a picture, the first of them twice, in parts of its width and height.
_CORNERS = [[0, 1, 1, 0, 0], [0, 0, 1, 1, 0]]


def one_caustic(ax: Axes, caustic: Caustic, *, zoom: bool | None = None) -> Axes:
    """On its surface; zoom, which is usual on spheres for one below 10 degrees: in its true shape about its middle."""
    if is_sphere(caustic.surface):
        zoom = is_small(caustic) if zoom is None else zoom
        draw = primary_zoom if zoom and caustic.kind != "point" else celestial_sphere
        draw(ax, caustic)
    else:
        draw_from_above(from_above(ax), caustic)
    ax.set_title(f"{style.order_name(caustic.order)} caustic")
    return ax


def caustic_set(ax: Axes, caustics: CausticSet, *, sky: str = "celestial") -> Axes:
    """The caustics on their surface, phi' wrapped; sky="camera": the critical curves round the shadow."""
    if sky not in ("celestial", "camera"):
        raise ValueError(f"Argument `sky` must be celestial or camera, but is {sky!r}.")
    if sky == "camera":
        shadow(ax, caustics.camera)
        for caustic in caustics:
            line = style.order_line(caustic.order)
            _on_sky(ax, whole_line(caustic.sky, caustic.closed), label=style.order_name(caustic.order), **line)
        return _legend(ax)
    for caustic in caustics:
        if is_sphere(caustics.surface):
            draw_wrapped(ax, caustic, 1.1, 0.7, label=style.order_name(caustic.order))
        else:
            draw_from_above(ax, caustic, label=style.order_name(caustic.order))
    return _legend(source_axes(ax, caustics.surface))


def cusp_place(ax: Axes, cusp: Cusp) -> Axes:
    """The cusp on the celestial sphere."""
    return draw_places(ax, SKY, cusp.celestial[None], marker="o")


def event_places(ax: Axes, events: Iterable[PairEvent]) -> Axes:
    """Places of the source, relative to the camera, at creations (up) and annihilations (down), one colour an order."""
    surface: End = SKY
    for event in events:
        surface = event.surface
        mark = {"marker": style.EVENTS.get(event.kind, "o"), "color": style.order_colour(event.order)}
        draw_places(ax, surface, np.array([event.star]), label=f"{event.kind}, order {event.order}", **mark)
    return _legend(source_axes(ax, surface))


def one_event(ax: Axes, event: PairEvent) -> Axes:
    """The place of the source at the event."""
    return event_places(ax, [event])


def ray_ends(ax: Axes, rays: Rays) -> Axes:
    """Ends of rays, theta' and phi'; those of rays that do not escape are left out."""
    ends = rays.direction.reshape(-1, 3)[rays.escaped.ravel()]
    return draw_places(ax, SKY, _angles(ends), marker=".", markersize=3)


def footprint_places(ax: Axes, footprint: Footprint) -> Axes:
    """Places on the celestial sphere that the pixels show."""
    return draw_places(ax, SKY, _angles(footprint.direction), marker=".", markersize=3)


def count_map(ax: Axes, counts: CountMap, *, caustics: CausticSet | tuple[Caustic, ...] = ()) -> Axes:
    """Totals over the surface, one colour a count; over a sphere with caustics of the same camera."""
    if is_sphere(counts.surface):
        return count_map_axes(ax, counts, caustics)
    places = np.stack(np.meshgrid(counts.level, counts.phi, indexing="ij"), axis=-1).reshape(-1, 2)
    return draw_totals(ax, counts.surface, places, counts.counts.sum(axis=2).ravel())


def star_counts(ax: Axes, counts: ImageCounts) -> Axes:
    """The sources, coloured by how many images each has."""
    return draw_totals(ax, counts.surface, counts.stars, counts.total)


def image_places(ax: Axes, images: StarImages) -> Axes:
    """On the camera sky about the hole: one colour an index, areas that grow with the magnification."""
    brightness = np.nan_to_num(images.magnification, nan=0.0, posinf=1e9)
    size = 6 + 5 * np.log10(np.clip(brightness / max(brightness.max(initial=0), 1e-300), 1e-4, 1)) / 4
    for k in np.unique(images.index).tolist():
        for place, large in zip(images.sky[images.index == k], size[images.index == k], strict=True):
            mark = {"marker": "o", "markersize": float(large), "color": style.order_colour(k + 1)}
            _on_sky(ax, place[None], linestyle="none", label=f"index {k}", **mark)
    return _legend(ax)


def followed_images(ax: Axes, star: FollowedStar) -> Axes:
    """The images at all cameras, darker from camera to camera."""
    for part, images in zip(np.linspace(0.15, 1, len(star.images)).tolist(), star.images, strict=True):
        _on_sky(ax, images.sky, linestyle="none", marker="o", markersize=3, color="black", alpha=part)
    return ax


def one_track(ax: Axes, track: Track) -> Axes:
    """On the camera sky about the hole, one colour an index."""
    for k, which in stretches(track):
        _on_sky(ax, track.sky[which], label=f"index {k}", **style.order_line(k + 1))
    for event in track.events:
        _on_sky(ax, event.sky[None], linestyle="none", marker=style.EVENTS.get(event.kind, "o"), color="black")
    return _legend(ax)


def all_tracks(ax: Axes, tracks: StarTracks) -> Axes:
    """All tracks round the shadow; triangles are creations (up) and annihilations (down)."""
    shadow(ax, tracks.camera)
    for track in tracks.tracks:
        one_track(ax, track)
    return _legend(ax)


def circle_curve(ax: Axes, curve: CircleCurve) -> Axes:
    """On the camera sky about the hole."""
    line = style.order_line(curve.index + 1)
    return _on_sky(ax, whole_line(curve.sky, curve.closed), label=f"index {curve.index}", **line)


def circle_curves(ax: Axes, circle: CircleImages) -> Axes:
    """The images of the great circle round the shadow, one colour an index."""
    shadow(ax, circle.camera)
    for curve in circle.curves:
        circle_curve(ax, curve)
    return _legend(ax)


def line_crossings(ax: Axes, crossings: LineCrossings) -> Axes:
    """On the camera sky about the hole."""
    return _on_sky(ax, crossings.sky, linestyle="none", marker="o", markersize=3, color="black")


def isoradial(ax: Axes, curve: Isoradial) -> Axes:
    """The curve on the camera sky about the hole."""
    return isoradials(ax, [curve])


def isoradials(ax: Axes, curves: Iterable[Isoradial]) -> Axes:
    """The images of circles round the hole, one colour a crossing of the plane."""
    for curve in curves:
        line = style.order_line(max(curve.crossing, 1))
        _on_sky(ax, whole_line(curve.sky, curve.closed), label=f"crossing {curve.crossing}", **line)
    return _legend(ax)


def spot_event(ax: Axes, event: SpotEvent) -> Axes:
    """The place of the event on the camera sky."""
    return _on_sky(ax, event.sky[None], linestyle="none", marker=style.EVENTS.get(event.kind, "o"), color="black")


def shadow(ax: Axes, camera: Viewer) -> Axes:
    """The shadow of the hole."""
    edge = shadow_edge(camera, 400)
    name_sky_axes(ax, edge)
    ax.fill(*about_hole(edge).T, label="shadow", **style.SHADOW)
    return ax


def picture_border(ax: Axes, view: Raster) -> Axes:
    """The border of the picture on the viewer's sky."""
    turn, last = np.linspace(0, 4, 801), np.array([view.width, view.height]) - 0.5
    x, y = (
        np.interp(turn, range(5), np.where(corners, end, -0.5)) for corners, end in zip(_CORNERS, last, strict=True)
    )
    sky = view.places(x, y)
    if sky.shape[-1] == 3:
        # Through the direction away from the hole, which is a whole circle here, no line is drawn.
        sky[1:][np.linalg.norm(np.diff(about_hole(sky), axis=0), axis=1) > 90] = np.nan
    return _on_sky(ax, sky, color="black", label="border of the picture")


def catalogue(ax: Axes, catalogue: StarCatalogue, *, brightest: int = 3000) -> Axes:
    """The brightest stars, bright ones larger, in the catalogue's own directions."""
    return _stars(ax, catalogue, np.eye(3), brightest)


def star_field(ax: Axes, field: StarField, *, brightest: int = 3000) -> Axes:
    """The brightest stars on the celestial sphere, bright ones larger."""
    return _stars(ax, field.catalogue, np.asarray(field.orientation, float), brightest)


def _stars(ax: Axes, catalogue: StarCatalogue, orientation: Float[Array, "3 3"], brightest: int) -> Axes:
    chosen = np.argsort(catalogue.magnitude)[:brightest]
    places = _angles(catalogue.direction[chosen] @ orientation.T)
    size = 10 ** (-0.2 * (catalogue.magnitude[chosen] - 2)) * 6
    ax.scatter(*on_axes(SKY, places), s=size, color="black", linewidths=0)
    return celestial_sphere_axes(ax)


def _on_sky(ax: Axes, sky: Float[Array, "n k"], **settings: Any) -> Axes:
    """A line, or points, on the camera sky: degrees to the right and up from the hole; of an Observer alpha, beta."""
    name_sky_axes(ax, sky)
    ax.plot(*about_hole(sky).T, **settings)
    return ax


def _legend(ax: Axes) -> Axes:
    """Every label once."""
    handles, labels = ax.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    if once:
        ax.legend(once.values(), once.keys(), loc="best", fontsize="small", handlelength=1.5)
    return ax


def _angles(direction: Float[Array, "n 3"]) -> Float[Array, "n 2"]:
    """(theta', phi') of unit vectors."""
    return np.stack([polar_angle(direction), np.arctan2(direction[:, 1], direction[:, 0])], axis=-1)
