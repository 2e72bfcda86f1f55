"""Plots of derivatives: a mark for each rate of change, on a logarithmic scale."""

import string

import numpy as np
from matplotlib.axes import Axes

from kerrcaustics.curves.derivatives import CausticDerivatives
from kerrcaustics.draw import style
from kerrcaustics.draw.sky_axes import is_sphere
from kerrcaustics.images.derivatives import ImageDerivatives
from kerrcaustics.shapes import Float
from kerrcaustics.tracks.event_derivatives import EventDerivatives

Array = np.ndarray

_BY = "for 1, GM/c² or rad"


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
