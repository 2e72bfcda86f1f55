"""Waves of one source: how its amplification depends on the frequency."""

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kerrcaustics.draw import style
from kerrcaustics.draw.titles import viewer_in_words
from kerrcaustics.waves.amplification import METHODS, Amplification
from kerrcaustics.waves.pattern import DiffractionPattern

_BAND = {"alpha": 0.25, "linewidth": 0}


def amplification_curve(ax: Axes, amplification: Amplification) -> Axes:
    """The modulus of the field against frequency, with a band as wide as its errors, one colour a method."""
    order = np.argsort(np.abs(amplification.frequency))
    omega, size = np.abs(amplification.frequency)[order], np.abs(amplification.value)[order]
    error, method = amplification.error[order], np.asarray(amplification.method)[order]
    for i, name in enumerate(METHODS[1:]):
        # Lines go on to the next frequency.
        here = method == name
        shown = here | np.append(False, here[:-1]) if len(here) > 1 else here
        if here.any():
            colour, line = style.PALETTE[i], np.where(shown, size, np.nan)
            ax.plot(omega, line, color=colour, label=name, marker="" if len(omega) > 1 else "o")
            ax.fill_between(omega, np.maximum(line - error, 0), line + error, color=colour, **_BAND)
    length = np.isinf(amplification.camera.radius) and not amplification.surface.finite
    unit = " ($GM/c^2$)" if length else ""
    ax.set(xscale="log", xlabel=r"angular frequency $\omega M$", ylabel=rf"$|F|${unit}", ylim=(0, None))
    if ax.lines:
        ax.legend()
    return ax


def intensity(ax: Axes, pattern: DiffractionPattern) -> Axes:
    """The intensity over the sources' places, theta' downward, with its scale."""
    phi, theta = np.degrees(pattern.phi), np.degrees(pattern.theta)
    image = ax.pcolormesh(phi, theta, np.abs(pattern.value) ** 2, cmap="magma", rasterized=True)
    unit = " ($G^2M^2/c^4$)" if np.isinf(pattern.camera.radius) else ""
    ax.figure.colorbar(image, ax=ax, label=rf"$|F|^2${unit}")
    ax.set(xlabel=r"$\phi'$ (deg)", ylabel=r"$\theta'$ (deg)")
    if not ax.yaxis_inverted():
        ax.invert_yaxis()
    return ax


def amplification_figure(amplification: Amplification) -> Figure:
    """The curve with the viewer and the source in its title."""
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.6), layout="constrained")
        ax = amplification_curve(figure.add_subplot(), amplification)
        theta, phi = np.degrees(amplification.source)
        ax.set_title(f"{viewer_in_words(amplification.camera)}; star at {theta:.6g}°, {phi:.6g}°")
    return figure
