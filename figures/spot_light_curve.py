"""
The light of a hot spot
=======================

A spot on a circular orbit at r = 6 round a hole of spin 0.998, seen from r = 50, inclination 75 degrees: its light
over an orbit, and what each crossing of the plane adds to it. Dashed lines tell when two images of the spot are
created, dotted ones when two are destroyed. Below: where its orbit is seen, crossing by crossing, and where images
are born and die.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.curves.light_curves import LightCurve
from kerrcaustics.draw import style
from kerrcaustics.draw.files import write_picture

CAMERA = kc.Camera(spin=0.998, radius=50.0, inclination=math.radians(75), velocity="static")
RADIUS, CROSSINGS = 6.0, 3
COLOURS = ("C0", "C1", "C2")


def flux_panel(ax: Axes, light: LightCurve) -> None:
    ax.semilogy(light.time, light.flux, color="black", label="all")
    for share, colour, crossing in zip(light.shares, COLOURS, ("first", "second", "third"), strict=True):
        ax.semilogy(light.time, np.maximum(share, 1e-12), color=colour, lw=1, label=f"{crossing} crossing")
    for event in light.events:
        line = "--" if event.kind == "creation" else ":"
        ax.axvline(event.time, color=COLOURS[event.crossing - 1], ls=line, lw=0.8)
    ax.set_xlim(0, light.period)
    ax.set_ylim(light.flux.max() / 3e4, 2 * light.flux.max())
    ax.set_xlabel("time of the camera (GM/c³)")
    ax.set_ylabel("flux of a unit spot")
    ax.legend(ncols=2, loc="lower center", fontsize="small")


def sky_panel(ax: Axes, light: LightCurve) -> None:
    view = kc.View(1000, 500, math.radians(22))

    def degrees(sky: np.ndarray) -> np.ndarray:
        place = view.pixels(sky) - [(view.width - 1) / 2, (view.height - 1) / 2]
        return np.degrees(np.arctan(place * view.pixel)) * [1, -1]

    edge = degrees(kc.shadow_edge(CAMERA, 400))
    ax.fill(*edge.T, color="0.85")
    for curve in kc.disk_images(CAMERA, [RADIUS], CROSSINGS, 1440):
        ax.plot(*degrees(np.append(curve.sky, curve.sky[:1], axis=0)).T, color=COLOURS[curve.crossing - 1], lw=1)
    for event in light.events:
        marker = "o" if event.kind == "creation" else "x"
        ax.plot(*degrees(event.sky), marker, color=COLOURS[event.crossing - 1], ms=5)
    ax.set_aspect("equal")
    ax.set_xlabel("to the right (deg)")
    ax.set_ylabel("up (deg)")


def main(output: Path) -> list[Path]:
    light = kc.light_curve(CAMERA, RADIUS, 400, size=0.1, crossings=CROSSINGS)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 6.6), layout="constrained")
        upper, lower = figure.subplots(2, 1, height_ratios=[1, 1.1])
        flux_panel(upper, light)
        sky_panel(lower, light)
    return [write_picture(figure, output / "spot_light_curve.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
