"""
Where a disk meets caustics
===========================

The equatorial plane of a hole of spin 0.998, seen from r = 1000: where the caustic of order n meets it at the
n-th crossing of rays, n = 2 and 3, for three inclinations of the camera, which is to the right. A spot that crosses
such a curve gains two images, or loses two. Grey: the horizon; dotted: the innermost stable orbit.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_picture
from kerrcaustics.spacetime import kerr

SPIN, RADIUS = 0.998, 1000.0
INCLINATIONS, CROSSINGS = (20.0, 45.0, 60.0), (2, 3)
WIDEST = 8.0


def panel(ax: Axes, inclination: float, crossing: int) -> None:
    camera = kc.Camera(SPIN, RADIUS, math.radians(inclination), "fiducial")
    for curve in kc.caustics(camera, 4, end=kc.EquatorialPlane(crossing)):
        r, phi = curve.place.T
        ax.plot(r * np.cos(phi), r * np.sin(phi), color=f"C{curve.order - 1}", lw=1)
    turn = np.linspace(0, 2 * math.pi, 200)
    horizon = kerr.horizon(SPIN)
    ax.fill(horizon * np.cos(turn), horizon * np.sin(turn), color="0.75")
    ax.plot(1.23697 * np.cos(turn), 1.23697 * np.sin(turn), ":", color="black", lw=0.7)
    ax.set(xlim=(-WIDEST, WIDEST), ylim=(-WIDEST, WIDEST), aspect="equal")


def main(output: Path) -> list[Path]:
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 5.2), layout="constrained")
        axes = figure.subplots(len(CROSSINGS), len(INCLINATIONS), sharex=True, sharey=True)
        for row, crossing in zip(axes, CROSSINGS, strict=True):
            for ax, inclination in zip(row, INCLINATIONS, strict=True):
                panel(ax, inclination, crossing)
                ax.set_title(f"{inclination:g}°, crossing {crossing}", fontsize="small")
        figure.suptitle(f"spin {SPIN}, radius {RADIUS:g}; inclination of the camera and crossing of the plane")
        for ax in axes[-1]:
            ax.set_xlabel("r cos φ (M)")
        for ax in axes[:, 0]:
            ax.set_ylabel("r sin φ (M)")
    return [write_picture(figure, output / "disk_caustics.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
