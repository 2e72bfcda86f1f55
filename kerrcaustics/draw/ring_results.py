"""Plots of photon rings on the sky of the viewer, and of what repeats along the shadow edge."""

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes

from kerrcaustics.draw import style
from kerrcaustics.draw.projection import about_shadow
from kerrcaustics.draw.sky_axes import name_sky_axes
from kerrcaustics.draw.sky_results import labelled_once, shadow
from kerrcaustics.rings.band_edge import BandEdge, has_point
from kerrcaustics.rings.results import PhotonBand, PhotonRings, RingEdge
from kerrcaustics.rings.visibility import Visibilities
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_BAND = {"alpha": 0.45, "linewidth": 0}


def band_edge(ax: Axes, edge: BandEdge) -> Axes:
    """The curve on the camera sky."""
    line = _closed(edge.camera, edge.sky)
    ax.plot(*line.T, label=f"n = {edge.order}, r = {edge.radius:.4g} M", **style.crossing_line(edge.order + 1))
    return labelled_once(name_sky_axes(ax, edge.camera.sky_unit))


def one_band(ax: Axes, band: PhotonBand) -> Axes:
    """The band on the camera sky."""
    _draw_bands(ax, [band])
    return labelled_once(name_sky_axes(ax, band.camera.sky_unit))


def bands_on_sky(ax: Axes, rings: PhotonRings) -> Axes:
    """The bands on the camera sky, one colour an order, and the shadow."""
    shadow(ax, rings.camera)
    _draw_bands(ax, rings.bands)
    return labelled_once(ax)


def exponents_along_edge(ax: Axes, edge: RingEdge) -> Axes:
    """gamma, delta and tau along the shadow edge, each relative to its value in the mean without spin."""
    phase = np.degrees(edge.edge_phase)
    order = np.argsort(phase)
    values = (edge.lyapunov / np.pi, r"$\gamma/\pi$"), (np.abs(edge.rotation) / np.pi, r"$|\delta|/\pi$")
    delay = edge.delay / (3 * np.sqrt(3) * np.pi), r"$\tau/(3\sqrt{3}\pi M)$"
    for number, (value, name) in enumerate((*values, delay)):
        ax.plot(phase[order], value[order], label=name, color=style.PALETTE[number])
    ax.set(xlabel="edge phase (deg; 0 prograde end, 180 retrograde end)", ylabel="for each order")
    ax.legend()
    return ax


def visibility_amplitude(ax: Axes, visibilities: Visibilities) -> Axes:
    """The modulus against the length of the baseline, one colour an order, with a band as wide as its errors."""
    length = np.hypot(visibilities.u, visibilities.v)
    rows = np.argsort(length)
    for number, order in enumerate(visibilities.order.tolist()):
        size, error = np.abs(visibilities.value[number])[rows], visibilities.error[number][rows]
        colour = style.crossing_colour(int(order) + 1)
        ax.plot(length[rows], size, color=colour, linewidth=0.8, label=f"n = {order}")
        ax.fill_between(length[rows], np.maximum(size - error, 0), size + error, color=colour, **_BAND)
    unit = r"G$\lambda$" if visibilities.unit == "giga-wavelengths" else "1/M"
    ax.set(xlabel=f"length of the baseline ({unit})", ylabel=r"$|V|$ ($M^2$)")
    if (length > 0).any() and (np.abs(visibilities.value) > 0).any():
        ax.set(yscale="log")
    return labelled_once(ax)


def _draw_bands(ax: Axes, bands: Iterable[PhotonBand]) -> None:
    for band in bands:
        colour, name = style.crossing_colour(band.order + 1), f"n = {band.order}"
        curves = [_closed(band.camera, _drawn(edge)) for edge in band.rims]
        if len(curves) == 2:
            ring = np.concatenate([curves[1], curves[0][::-1]])
            ax.fill(*ring.T, facecolor=colour, label=name, **_BAND)
        for curve in curves:
            ax.plot(*curve.T, color=colour, linewidth=0.8, label=name if len(curves) == 1 else None)


def _drawn(edge: BandEdge) -> Float[Array, "m axes"]:
    """The points of an edge; the upper half where the lower one is a single point."""
    return edge.sky[: len(edge.sky) // 2] if has_point(edge) else edge.sky


def _closed(camera: Viewer, sky: Float[Array, "n axes"]) -> Float[Array, "m 2"]:
    """A curve on the picture of the viewer's sky, its first point repeated."""
    line = about_shadow(camera, sky)
    return np.concatenate([line, line[:1]])
