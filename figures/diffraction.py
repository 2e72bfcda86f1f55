"""
Waves at caustics
=================

(a) The intensity of a monochromatic source, divided by that without the hole, for sources all around the secondary
caustic (white) of a hole of spin 0.5 seen from r = 16. Inside the caustic there are two more images, which interfere:
fringes run along each fold. The fine ripple everywhere comes from the wave of index 0, which interferes with that of
index 1. (b) The left cusp enlarged, at four times the frequency: the pattern that Pearcey computed. (c) A cut through
(a) across two folds, and (d) one along the axis through the right cusp; dashed lines mark the caustic. In geometric
optics the intensity is infinite there; a wave is brightest a little inside. Dots: single sources with their errors,
computed one by one. (e), (f) The glory: sources around the direction opposite to a camera at r = 10. Without spin the
caustic is a point, and the rings are those of a Bessel function; with spin 0.9 it is an astroid (white), whose folds
and cusps have fringes of their own. (g), (h) The near cusp of the secondary caustic (white) of a = 0.999 seen from r =
6.03, the hole and camera of the paper's Fig. 8, and the cusp enlarged at four times the frequency. This caustic is 250
degrees long: the sum over the ring of its images leaves out the lines on which the direction nearest to the source
jumps to the far end of the caustic.

The paper has no such figure. Scalar waves, images of index 0 to 2; in (g) and (h) the images that lie beside the
tertiary caustic are left out.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_line_art

CAMERA = kc.Camera(spin=0.5, radius=16.0, inclination=1.2, velocity="fiducial")
WHOLE = (1.05, 1.36), (5.54, 5.90)
CUSP = (1.17, 1.23), (5.553, 5.618)
"""Regions of the celestial sphere, theta' and phi'."""
FREQUENCY = 60.0
FOLDS, ALONG = (1.25, (5.70, 5.84)), (1.2, (5.80, 5.90))
"""theta' and range of phi' of the cuts."""
GLORY = 1500.0
WIDE = 0.0026
"""Radians to each side of the caustic."""
LONG = kc.Camera(spin=0.999, radius=6.03)
NEAR_END, NEAR_CUSP = ((1.3, 1.84), (5.15, 5.6)), ((1.53, 1.61), (5.385, 5.47))
LONG_FREQUENCY = 40.0


def main(output: Path) -> list[Path]:
    caustic = kc.caustics(CAMERA, orders=2)[1]
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 11.4), layout="constrained")
        rows = figure.subfigures(4, 1, height_ratios=(1.2, 0.9, 1.3, 1.3))
        for ax, letter, region, times in zip(rows[0].subplots(1, 2), "ab", (WHOLE, CUSP), (1, 4), strict=True):
            draw_pattern(ax, caustic, region, FREQUENCY * times)
            ax.set_title(rf"({letter}) a = 0.5, r = 16, $\omega M = {FREQUENCY * times:g}$")
        draw_cuts(rows[1], caustic)
        for ax, letter, spin in zip(rows[2].subplots(1, 2), "ef", (0.0, 0.9), strict=True):
            camera = kc.Camera(spin=spin, radius=10.0, inclination=1.2, velocity="fiducial")
            (caustic,) = kc.caustics(camera, orders=1)
            draw_pattern(ax, caustic, tuple((x - WIDE, x + WIDE) for x in caustic.place.mean(axis=0)), GLORY)
            ax.set_title(rf"({letter}) glory, a = {spin:g}, r = 10, $\omega M = {GLORY:g}$")
        caustic = kc.caustics(LONG, orders=2)[1]
        for ax, letter, region, times in zip(rows[3].subplots(1, 2), "gh", (NEAR_END, NEAR_CUSP), (1, 4), strict=True):
            draw_pattern(ax, caustic, region, LONG_FREQUENCY * times, max_index=1)
            ax.set_title(rf"({letter}) a = 0.999, r = 6.03, $\omega M = {LONG_FREQUENCY * times:g}$")
    return write_line_art(figure, output, "diffraction")


def draw_pattern(ax: Axes, caustic: kc.Caustic, region: tuple, frequency: float, max_index: int = 2) -> None:
    """The intensity of sources in a region, with the caustic."""
    pattern = kc.diffraction_pattern(caustic.camera, region, frequency, max_index=max_index, pixels=400)
    extent = np.degrees([*region[1], region[0][1], region[0][0]])
    image = ax.imshow(
        np.abs(pattern.value) ** 2, extent=tuple(extent), cmap="magma", aspect=1 / math.sin(region[0][0]), vmin=0
    )
    ax.plot(*np.degrees(np.vstack([caustic.place, caustic.place[:1]]).T[::-1]), color="white", linewidth=0.6)
    ax.set(xlabel=r"$\phi'$ (deg)", ylabel=r"$\theta'$ (deg)", xlim=extent[:2], ylim=extent[2:])
    ax.figure.colorbar(image, ax=ax, label=r"$|F|^2$", shrink=0.8)


def draw_cuts(row: SubFigure, caustic: kc.Caustic) -> None:
    """The modulus of the field along two lines, with sources that are computed one by one."""
    for ax, letter, (theta, span) in zip(row.subplots(1, 2), "cd", (FOLDS, ALONG), strict=True):
        strip = kc.diffraction_pattern(CAMERA, ((theta, theta + 1e-6), span), FREQUENCY, pixels=600)
        ax.plot(np.degrees(strip.phi), np.abs(strip.value[0]), color=style.PALETTE[0])
        for edge in meetings(caustic.place, theta):
            if span[0] < edge < span[1]:
                ax.axvline(math.degrees(edge), color="0.5", linestyle="--", linewidth=0.8)
        for phi in np.linspace(*span, 14)[1:-1]:
            one = kc.amplification(CAMERA, (theta, phi), [FREQUENCY])
            ax.errorbar(math.degrees(phi), abs(one.value[0]), one.error[0], fmt="k.", markersize=4, linewidth=0.8)
        kind = "two folds" if letter == "c" else "a cusp"
        ax.set(title=rf"({letter}) {kind}, $\theta' = {math.degrees(theta):.1f}$ deg", xlabel=r"$\phi'$ (deg)")
        ax.set(ylabel="$|F|$", ylim=(0, None))


def meetings(place: np.ndarray, theta: float) -> list[float]:
    """Azimuths at which a closed curve of (theta', phi') meets a parallel, or touches it."""
    away = np.append(place[:, 0], place[0, 0]) - theta
    phi = np.append(place[:, 1], place[0, 1])
    (steps,) = np.nonzero(away[1:] * away[:-1] <= 0)
    part = np.divide(
        away[steps], away[steps] - away[steps + 1], where=away[steps] != away[steps + 1], out=0 * away[steps]
    )
    return (phi[steps] + part * (phi[steps + 1] - phi[steps])).tolist()


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
