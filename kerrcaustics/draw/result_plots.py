"""The plots of results by the name of their class, and the small pictures of notebooks.

Plots on the sky are in `sky_results`; those of light, of derivatives and in space are here.
"""

import math
import string
from collections.abc import Callable, Sized
from typing import Any, get_args

import matplotlib.pyplot as plt
import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Annulus, Ellipse

from kerrcaustics.beams.beam import Status
from kerrcaustics.beams.path_beams import PathBeams
from kerrcaustics.beams.paths import RayPaths, SpacePoints, cartesian
from kerrcaustics.choices import PlaneName
from kerrcaustics.curves.derivatives import CausticDerivatives
from kerrcaustics.curves.tubes import CausticTube
from kerrcaustics.draw import sky_results, source_images, style
from kerrcaustics.draw.light_curves import show_flux, sky_area
from kerrcaustics.draw.scenes import show_picture
from kerrcaustics.draw.sky_axes import REACH, checked_scale, from_above, from_the_side, is_sphere
from kerrcaustics.draw.solids import CAPTURED_COLOUR, DISK_COLOUR, DISK_RIM_COLOUR
from kerrcaustics.draw.titles import viewer_in_words
from kerrcaustics.draw.waves import amplification_curve, intensity
from kerrcaustics.images.derivatives import ImageDerivatives
from kerrcaustics.light_curves.results import LightCurve
from kerrcaustics.results.shown import Items
from kerrcaustics.scenes.disk.profile import LineProfile
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.render_volume import VolumeRendering
from kerrcaustics.scenes.rendering import Rendering
from kerrcaustics.scenes.tones import AUTO, Auto, tone_mapped
from kerrcaustics.scenes.traced_view import TracedView
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import one_of
from kerrcaustics.spacetime.shadow import shadow_axes, shadow_edge
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.event_derivatives import EventDerivatives

Array = np.ndarray

_SMALL = (4.4, 2.9)
_BY = "for 1, GM/c² or rad"


def light_curve(ax: Axes, light: LightCurve, *, scale: object = None) -> Axes:
    """The flux and what each image adds to it, with creations (up) and annihilations (down).

    `scale`: a `PhysicalScale`, for times in minutes.
    """
    return show_flux(ax, light, checked_scale(scale))


def line_profile(ax: Axes, profile: LineProfile) -> Axes:
    """Light in each bin, with its error."""
    ax.stairs(profile.flux, profile.edges, color="black")
    middle = (profile.edges[1:] + profile.edges[:-1]) / 2
    finite = np.isfinite(profile.error)
    ax.errorbar(middle[finite], profile.flux[finite], profile.error[finite], color="black", linestyle="none")
    ax.set(xlabel="frequency, camera over emitter", ylabel=f"light ({sky_area(profile.camera)})")
    return ax


def rendering(
    ax: Axes, rendering: Rendering | VolumeRendering, *, exposure: float | Auto = AUTO, curve: str = "asinh"
) -> Axes:
    """The picture, in degrees from its middle; `exposure` and `curve` as for `tone_mapped`."""
    picture = tone_mapped(np.nan_to_num(rendering.light), exposure, curve)
    return show_picture(ax, rendering.view, picture, middle=_middle(rendering.camera, rendering.view))


def _middle(camera: Viewer, view: Raster) -> str:
    """The name of what lies in the middle of a picture."""
    forward = getattr(view, "forward", None)
    toward_hole = forward is not None and np.allclose(forward, shadow_axes(camera, shadow_edge(camera, 720))[0])
    return "shadow's middle" if toward_hole else "picture's middle"


def traced_view(ax: Axes, traced: TracedView) -> Axes:
    """The open sky, white, and the shadow, black; all white if no sky was traced."""
    shape = traced.view.height, traced.view.width
    part = np.ones(shape) if traced.visible_fraction is None else np.nan_to_num(traced.visible_fraction)
    return show_picture(ax, traced.view, np.repeat((255 * np.clip(part, 0, 1)).astype(np.uint8)[..., None], 3, axis=2))


def space_points(
    ax: Axes,
    points: SpacePoints,
    plane: str = "xy",
    disk: tuple[float, float] | None = None,
    colour: str | None = None,
) -> Axes:
    """The paths as far as 20 M, the hole and a `disk` between two rims, from above or, `plane="xz"`, from the side.

    Rays have the colour of their Morse index, captured ones are grey, unless there is a `colour` for all.
    """
    one_of("plane", plane, get_args(PlaneName))
    horizon = kerr.horizon(points.spin)
    width = 2 * math.hypot(horizon, points.spin)
    ax.add_patch(Ellipse((0, 0), width, width if plane == "xy" else 2 * horizon, color="black"))
    _draw_disk(ax, points.spin, plane, disk)
    size = points.radius.shape[-1] if points.radius.ndim else 1
    near = np.where(points.radius < REACH, points.radius, np.nan)
    x, y, z = (part.reshape(-1, size).T for part in np.moveaxis(cartesian(points.spin, near, points.direction), -1, 0))
    drawn = ax.plot(x, y if plane == "xy" else z, linewidth=0.8, color=colour)
    if isinstance(points, RayPaths) and colour is None:
        _colour_rays(ax, points, drawn)
    return from_above(ax) if plane == "xy" else from_the_side(ax)


def _draw_disk(ax: Axes, spin: float, plane: str, disk: tuple[float, float] | None) -> None:
    """A disk between two radii, from above or on edge."""
    if disk is None:
        return
    inner, outer = (math.hypot(rim, spin) for rim in disk)
    if plane == "xy":
        ax.add_patch(Annulus((0, 0), outer, outer - inner, color=DISK_COLOUR, zorder=0))
        return
    for side in (-1, 1):
        ax.plot([side * inner, side * outer], [0, 0], color=DISK_RIM_COLOUR, linewidth=2.5, solid_capstyle="butt")


def _colour_rays(ax: Axes, paths: RayPaths, drawn: list[Line2D]) -> None:
    """Rays in the colours of their indices, captured ones grey, with a legend."""
    indices, statuses = np.ravel(paths.index).tolist(), np.ravel(paths.status).tolist()
    named = set(ax.get_legend_handles_labels()[1])
    for line, index, status in zip(drawn, indices, statuses, strict=True):
        captured = status == Status.CAPTURED
        words = "captured" if captured else f"index {index}"
        line.set(color=CAPTURED_COLOUR if captured else style.index_colour(max(index, 0)))
        line.set_label(words if words not in named and index >= 0 else "_ray")
        named.add(words)
    if named:
        ax.legend()


def path_beams(ax: Axes, beams: PathBeams) -> Axes:
    """The diameters of each beam from place to place, the minor one dashed."""
    size = beams.diameter_error.shape[-1] if beams.diameter_error.ndim else 1
    for values, look in ((beams.delta_plus, "-"), (beams.delta_minus, "--")):
        for i, line in enumerate(values.reshape(-1, size)):
            ax.plot(line, look, color=style.PALETTE[i % len(style.PALETTE)], linewidth=0.8)
    ax.axhline(0, color="black", linewidth=0.5)
    ax.set(xlabel="place", ylabel="diameters over the radius")
    return ax


def tube_rows(ax: Axes, tube: CausticTube) -> Axes:
    """The rows of the tube as far as 20 M."""
    return space_points(ax, tube.points)


def image_derivatives(ax: Axes, derivatives: ImageDerivatives) -> Axes:
    """Movement of each image on the camera sky with each parameter."""
    speed = np.linalg.norm(derivatives.sky, axis=1)
    _marks(ax, derivatives.parameters, speed, derivatives.error[:, 0] * speed.max(axis=1, initial=0))
    ax.set_xticks(range(len(derivatives)))
    unit = derivatives.camera.sky_unit.replace("^2", "²")
    ax.set(xlabel="image", ylabel=f"movement on the camera sky ({unit} {_BY})")
    return ax


def caustic_derivatives(ax: Axes, derivatives: CausticDerivatives) -> Axes:
    """Change of the widths and the cusps of the caustic with each parameter."""
    names, rows = ["width φ′"], [derivatives.phi_extent]
    if is_sphere(derivatives.surface):
        names, rows = ["width θ′", *names], [derivatives.theta_extent, *rows]
    else:
        names, rows = ["least r", "largest r", *names], [derivatives.r_min, derivatives.r_max, *rows]
    for letter, (theta, phi) in zip(string.ascii_uppercase, derivatives.cusps, strict=False):
        names += [f"{letter} θ′", f"{letter} φ′"]
        rows += [theta, phi]
    sizes = np.abs(rows)
    _marks(ax, derivatives.parameters, sizes, derivatives.error * sizes.max(axis=1, initial=0))
    ax.set_xticks(range(len(names)), names, rotation=90)
    ax.set(ylabel=f"change (GM/c² or rad {_BY})", title=f"{style.order_name(derivatives.order)} caustic")
    return ax


def event_derivatives(ax: Axes, derivatives: EventDerivatives) -> Axes:
    """Change of the azimuth of each event with each parameter."""
    sizes = np.abs(derivatives.azimuth)
    _marks(ax, derivatives.parameters, sizes, derivatives.error[:, 0] * sizes.max(axis=1, initial=0))
    ax.set_xticks(range(len(derivatives)))
    ax.set(xlabel="event", ylabel=f"change of azimuth (rad {_BY})")
    return ax


def _marks(ax: Axes, names: tuple[str, ...], rows: Float[Array, "row name"], errors: Float[Array, " row"]) -> None:
    """Mark each row at its number, its columns beside, on a logarithmic scale; what is within its error is left out."""
    visible = np.where(rows > errors[:, None], rows, np.nan)
    for j, name in enumerate(names):
        beside = np.arange(len(rows)) + 0.1 * (j - (len(names) - 1) / 2)
        look = {"color": style.PALETTE[j % len(style.PALETTE)], "marker": "o", "markersize": 3, "linestyle": "none"}
        ax.errorbar(beside, visible[:, j], errors, label=name, **look)
    ax.set_yscale("log")
    ax.legend()


PLOTS: dict[str, Callable[..., Axes]] = {
    "Amplification": amplification_curve,
    "Beams": sky_results.ray_ends,
    "Camera": sky_results.shadow,
    "Caustic": sky_results.one_caustic,
    "CausticDerivatives": caustic_derivatives,
    "CausticSet": sky_results.caustic_set,
    "CausticTube": tube_rows,
    "CircleCurve": sky_results.circle_curve,
    "CircleImages": sky_results.circle_curves,
    "CountMap": sky_results.count_map,
    "Cusp": sky_results.cusp_place,
    "DiffractionPattern": intensity,
    "EventDerivatives": event_derivatives,
    "IsoradialSet": sky_results.isoradials,
    "FollowedStar": sky_results.followed_images,
    "Footprint": sky_results.footprint_places,
    "ImageCounts": sky_results.star_counts,
    "ImageDerivatives": image_derivatives,
    "Isoradial": sky_results.isoradial,
    "LightCurve": light_curve,
    "LimbImage": source_images.limb_image,
    "LineCrossings": sky_results.line_crossings,
    "LineProfile": line_profile,
    "Magnification": source_images.source_images,
    "Observer": sky_results.shadow,
    "PairEvent": sky_results.one_event,
    "PairEvents": sky_results.event_places,
    "PathBeams": path_beams,
    "RayPaths": space_points,
    "Rays": sky_results.ray_ends,
    "Rendering": rendering,
    "SourceEvent": sky_results.spot_event,
    "SpacePoints": space_points,
    "SpotEvent": sky_results.spot_event,
    "StarCatalogue": sky_results.catalogue,
    "Screen": sky_results.picture_border,
    "StarField": sky_results.star_field,
    "StarImages": sky_results.image_places,
    "StarTracks": sky_results.all_tracks,
    "TracedView": traced_view,
    "Track": sky_results.one_track,
    "View": sky_results.picture_border,
    "VolumeRendering": rendering,
}
"""The functions that draw results, by the names of their classes; docs/plots.md shows what they say of themselves."""


def plot(result: Any, ax: Axes | None = None, **settings: Any) -> Axes:
    """Draw a result on axes, new ones where none are given, and return them."""
    name = type(result).__name__
    if name not in PLOTS:
        raise ValueError(f"Argument `result` must be one of {', '.join(sorted(PLOTS))} to be drawn, but is {name}.")
    if ax is not None:
        return _titled(PLOTS[name](ax, result, **settings), result)
    with rc_context(style.RC):
        return plot(result, plt.figure(layout="constrained").add_subplot(), **settings)


def _titled(ax: Axes, result: Any) -> Axes:
    """Axes with the viewer of the result in their title, where they have none; with the spin where that is known."""
    viewer = _viewer(result)
    if not ax.get_title() and isinstance(viewer, Viewer):
        ax.set_title(viewer_in_words(viewer))
    elif not ax.get_title() and hasattr(result, "spin"):
        ax.set_title(f"spin {result.spin:.12g}")
    return ax


def _viewer(result: Any) -> Viewer | None:
    """The viewer that a result is, or knows; of a sequence without one of its own, that of its items."""
    if isinstance(result, Viewer):
        return result
    items = result[:1] if isinstance(result, Items) else ()
    return getattr(result, "camera", getattr(items[0], "camera", None) if items else None)


def small_picture(result: Any) -> Figure | None:
    """A small figure of a result; None for one that cannot be drawn, or that holds nothing."""
    if type(result).__name__ not in PLOTS or _is_empty(result):
        return None
    with rc_context(style.RC):
        figure = Figure(figsize=_SMALL, layout="constrained", dpi=100)
        plot(result, figure.add_subplot())
    return figure


def _is_empty(result: Any) -> bool:
    """True if a result is an empty sequence, or one of its arrays is empty."""
    if isinstance(result, Sized):
        return len(result) == 0
    return any(isinstance(part, np.ndarray) and part.size == 0 for part in vars(result).values())
