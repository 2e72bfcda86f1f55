"""Plots of light: pictures, light curves, spectra."""

import math

import numpy as np
from matplotlib.axes import Axes

from kerrcaustics.draw.light_curves import show_flux, sky_area
from kerrcaustics.draw.scenes import show_picture
from kerrcaustics.scenes.colour import tone_mapped
from kerrcaustics.scenes.disk.profile import LineProfile
from kerrcaustics.scenes.render import Rendering, TracedView
from kerrcaustics.scenes.render_volume import VolumeRendering
from kerrcaustics.tracks.light_curves import LightCurve

Array = np.ndarray

# Without an exposure, the part of the pixels that are brighter than this; the curve leaves them room for their colours.
_BRIGHT, _LEVEL = 0.003, 0.4


def light_curve(ax: Axes, light: LightCurve) -> Axes:
    """The flux and what each crossing adds, with creations (dashed) and annihilations (dotted)."""
    show_flux(ax, light)
    return ax


def line_profile(ax: Axes, profile: LineProfile) -> Axes:
    """Light in each bin, with its error."""
    ax.stairs(profile.flux, profile.edges, color="black")
    middle = (profile.edges[1:] + profile.edges[:-1]) / 2
    finite = np.isfinite(profile.error)
    ax.errorbar(middle[finite], profile.flux[finite], profile.error[finite], color="black", linestyle="none")
    ax.set(xlabel="frequency, camera over emitter", ylabel=f"light ({sky_area(profile.camera)})")
    return ax


def rendering(
    ax: Axes, rendering: Rendering | VolumeRendering, *, exposure: float | None = None, curve: str = "asinh"
) -> Axes:
    """The picture, in degrees from its middle; exposure and curve as for `tone_mapped`, by the light when left out."""
    if exposure is None:
        bright = float(np.nanquantile(rendering.light.max(axis=2), 1 - _BRIGHT))
        exposure = _LEVEL / bright if 0 < bright < math.inf else 1.0
    return show_picture(ax, rendering.view, tone_mapped(np.nan_to_num(rendering.light), exposure, curve))


def traced_view(ax: Axes, traced: TracedView) -> Axes:
    """The open sky, white, and the shadow, black; all white if no sky was traced."""
    shape = traced.view.height, traced.view.width
    part = np.ones(shape) if traced.visible_fraction is None else np.nan_to_num(traced.visible_fraction)
    return show_picture(ax, traced.view, np.repeat((255 * np.clip(part, 0, 1)).astype(np.uint8)[..., None], 3, axis=2))
