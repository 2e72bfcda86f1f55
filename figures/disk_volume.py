"""
A thick torus compared with a thin disk
=======================================

The same camera, radii, temperatures and light twice: an opaque disk without thickness, and a torus filled with matter.
The torus is the one whose matter has the same angular momentum everywhere, so that pressure holds it up (Abramowicz,
Jaroszynski & Sikora 1978); each ray is followed through it step by step. The torus hides the lower half of its far side
and most of the shadow, and its rims are soft where it is thin.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_picture
from kerrcaustics.draw.scenes import show_picture
from kerrcaustics.draw.titles import viewer_in_words

CAMERA = kc.Camera(spin=0.6, radius=74.1, inclination=math.radians(80), velocity="static")
VIEW = kc.pictures.View(560, 320, math.radians(38))
SKY = kc.skies.StarField()
EXPOSURE = 1 / 8_000
INNER, OUTER = 6.0, 18.7
# Kelvin, at r = 10; and optical depth for each M in the torus's middle.
LAW = kc.disks.PowerLaw(5500, exponent=0.5)
DENSEST = 0.6
LIGHT = {"beaming": True, "colour_shift": True}


def metric(radius: np.ndarray, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """g_tt, g_tphi and g_phiphi."""
    a, s2 = CAMERA.spin, np.sin(theta) ** 2
    pull = 2 * radius / (radius**2 + a**2 * np.cos(theta) ** 2)
    return pull - 1, -pull * a * s2, (radius**2 + a**2 * (1 + pull * s2)) * s2


def potential(momentum: float, radius: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """ln(-u_t) of matter of an angular momentum per energy: surfaces of the torus are those where it is constant."""
    tt, tphi, phiphi = metric(radius, theta)
    square = phiphi + 2 * momentum * tphi + momentum**2 * tt
    return 0.5 * np.log((tphi**2 - tt * phiphi) / np.where(square > 0, square, np.nan))


def momentum_between(inner: float, outer: float) -> float:
    """The angular momentum of the torus that reaches from one radius to another."""
    low, high = 3.0, 6.0
    for _ in range(60):
        middle = (low + high) / 2
        edges = potential(middle, np.array([inner, outer]), np.full(2, math.pi / 2))
        low, high = (middle, high) if edges[0] < edges[1] else (low, middle)
    return low


class Torus:
    """Density and motion of the torus: full in its middle, nothing beyond the surface through its rims."""

    def __init__(self, inner: float, outer: float) -> None:
        self.momentum = momentum_between(inner, outer)
        radius = np.linspace(inner, outer, 2001)
        depth = potential(self.momentum, radius, np.full_like(radius, math.pi / 2))
        self.surface, self.middle = depth[0], depth.min()

    def density(self, radius: np.ndarray, theta: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
        depth = (self.surface - potential(self.momentum, radius, theta)) / (self.surface - self.middle)
        return DENSEST * np.nan_to_num(np.maximum(depth, 0)) ** 1.5

    def orbital(self, radius: np.ndarray, theta: np.ndarray) -> np.ndarray:
        tt, tphi, phiphi = metric(radius, theta)
        return -(tphi + self.momentum * tt) / (phiphi + self.momentum * tphi)


def temperature(radius: np.ndarray, theta: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    return LAW.temperature(CAMERA.spin, radius)


def main(output: Path) -> list[Path]:
    torus = Torus(INNER, OUTER)
    brightness = 0.8 / EXPOSURE
    disk = kc.disks.Disk(INNER, OUTER, LAW, brightness=brightness)
    volume = kc.disks.Volume(
        torus.density, temperature, INNER, OUTER, scale=1.0, motion=torus.orbital, brightness=brightness
    )
    lights = {
        "thin disk": kc.render(CAMERA, VIEW, SKY, disk=disk, **LIGHT).light,
        "thick torus": kc.pictures.render_volume(CAMERA, VIEW, volume, SKY, **LIGHT).light,
    }
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 2.7), layout="constrained")
        for ax, (name, light) in zip(figure.subplots(1, 2, sharey=True), lights.items(), strict=True):
            show_picture(ax, VIEW, kc.pictures.tone_mapped(light, EXPOSURE, curve="asinh", softening=6))
            ax.set_title(name)
            ax.label_outer()
        figure.suptitle(viewer_in_words(CAMERA))
    return [write_picture(figure, output / "disk_volume.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
