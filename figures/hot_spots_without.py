"""
Hot spots, with one effect left out at a time
=============================================

The picture drawn by an older tracer: spots on circular orbits of r = 6 to 9 round a hole that does not spin, seen from
r = 12. Each of five planes has orbits of its own, at inclinations of 83 to 86 degrees and rolled by 15 degrees, give or
take two; every spot has a brightness of its own, and a streak that fades quadratically. Then the same without the
light's travel time, so that all images show one moment; without the shift of brightness, so that one side is as bright
as the other; with half of the spots circling the other way; and, for one of the planes alone, as seen by an observer at
rest and by one who circles the hole.
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
from kerrcaustics.scenes.render import TracedView

RADIUS, INNER, OUTER = 12.0, 6.0, 9.0
# Of a circular orbit there, as one at rest measures it.
SPEED = 1 / math.sqrt(RADIUS - 2)
# Degrees: inclination and roll of each plane.
PLANES = ((83.0, 13.6), (84.0, 16.2), (84.6, 14.4), (85.3, 16.9), (86.0, 15.0))
SPOTS, SIZE, STREAK, TIME = 900, 0.04, 6.0, 40.0
WIDTH, HEIGHT, FIELD = 400, 225, 2 * math.atan(1.28)
ALL = {"beaming": True, "colour_shift": True, "delay": True, "time": TIME}


def disk(seed: int, retrograde: float = 0.0) -> kc.disks.Disk:
    """Spots of one plane, which hide nothing: so the light of several planes is a sum."""
    rng = np.random.default_rng(seed)
    radius, azimuth = np.sqrt(rng.uniform(INNER**2, OUTER**2, SPOTS)), rng.uniform(0, 2 * math.pi, SPOTS)
    temperature, brightness = rng.uniform(4000, 10_000, SPOTS), rng.uniform(0.3, 1.7, SPOTS)
    spots = kc.disks.Spots(
        radius,
        azimuth,
        temperature,
        SIZE,
        STREAK,
        brightness=brightness,
        retrograde=rng.random(SPOTS) < retrograde,
        fade="quadratic",
    )
    return kc.disks.Disk(INNER - 0.2, OUTER + 0.2, spots, opacity=0.0)


def traced(inclination: float, roll: float, speed: float | None = None) -> TracedView:
    """A plane as the camera sees it: without spin, orbits in any plane are those of the equator."""
    velocity = "static" if speed is None else (0.0, 0.0, speed)
    camera = kc.Camera(0.0, RADIUS, math.radians(inclination), velocity)
    forward = kc.pictures.View.toward_hole(camera, WIDTH, HEIGHT, FIELD).forward
    up = 0.0, math.sin(math.radians(roll)), math.cos(math.radians(roll))
    view = kc.pictures.View(WIDTH, HEIGHT, FIELD, forward=forward, up=up)
    return kc.pictures.trace_view(camera, view, sky=False, disk=disk(0), delay=True)


def main(output: Path) -> list[Path]:
    planes = [traced(*plane) for plane in PLANES]

    def light(retrograde: float = 0.0, **changes: bool) -> np.ndarray:
        return sum(plane.show(disk=disk(i, retrograde), **{**ALL, **changes}).light for i, plane in enumerate(planes))

    moving = traced(*PLANES[-1], SPEED)
    pictures = {
        "all effects": light(),
        "without travel time": light(delay=False),
        "without the shift of brightness": light(beaming=False),
        "half of the spots circling the other way": light(retrograde=0.5),
        "one plane, camera at rest": planes[-1].show(disk=disk(9), **ALL).light,
        f"one plane, camera at {SPEED:.3f} c": moving.show(disk=disk(9), **ALL).light,
    }
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 6.3), layout="constrained")
        for ax, (name, part) in zip(
            figure.subplots(3, 2, sharex=True, sharey=True).flat, pictures.items(), strict=True
        ):
            show_picture(ax, moving.view, kc.pictures.tone_mapped(part, exposure=0.5, curve="asinh", softening=8))
            ax.set_title(name)
            ax.label_outer()
        figure.suptitle(f"hot spots round a hole without spin, seen from r = {RADIUS:g} M")
    return [write_picture(figure, output / "hot_spots_without.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
