"""Plots of results about light: curves and profiles, and pictures of disks and skies."""

import numpy as np
from matplotlib.axes import Axes

from kerrcaustics.draw.light_curves import show_flux, sky_area
from kerrcaustics.draw.scenes import show_picture
from kerrcaustics.interop.physical_scale import checked_scale
from kerrcaustics.light_curves.results import LightCurve
from kerrcaustics.scenes.disk.profile import LineProfile
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.render_volume import VolumeRendering
from kerrcaustics.scenes.rendering import Rendering
from kerrcaustics.scenes.tones import AUTO, Auto, tone_mapped
from kerrcaustics.scenes.traced_view import TracedView
from kerrcaustics.spacetime.shadow import shadow_axes, shadow_edge
from kerrcaustics.spacetime.viewer import Viewer


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
