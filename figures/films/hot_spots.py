"""
Hot spots in a disk
===================

5000 spots, black bodies of 4000 to 10,000 K, on circular orbits of r = 6 to 9 round a hole that does not spin. Seen
from r = 12, inclination 85 degrees, with all images and the light's travel time; every spot leaves a streak that fades
over 6 units of time. The approaching side is brighter and bluer; below and round the shadow the same spots are seen
at earlier times.
"""

import math

import numpy as np

import kerrcaustics as kc
from kerrcaustics.draw.films import Film

RADIUS, INCLINATION, ROLL = 12.0, 85.0, 15.0
OUTER, SPOTS, SIZE, STREAK = 9.0, 5000, 0.03, 6.0
WIDTH, HEIGHT, FIELD = 960, 540, 2 * math.atan(1.28)
SEED, PER_FRAME = 2015, 0.8


def spots(inner: float) -> kc.disks.Spots:
    rng = np.random.default_rng(SEED)
    # As many on each area of the disk.
    radius = np.sqrt(rng.uniform(inner**2, OUTER**2, SPOTS))
    return kc.disks.Spots(radius, rng.uniform(0, 2 * math.pi, SPOTS), rng.uniform(4000, 10_000, SPOTS), SIZE, STREAK)


def film(frames: int = 150, name: str = "hot_spots", spin: float = 0.0, inner: float = 6.0) -> Film:
    camera = kc.Camera(spin, RADIUS, math.radians(INCLINATION), "static")
    disk = kc.disks.Disk(inner - 0.2, OUTER + 0.2, spots(inner), opacity=0.0)
    roll = math.radians(ROLL)
    view = kc.pictures.View(WIDTH, HEIGHT, FIELD, up=(0.0, math.sin(roll), math.cos(roll)))
    traced = kc.pictures.trace_view(camera, view, sky=False, disk=disk, delay=True)

    def draw(number: int) -> np.ndarray:
        switches = {"beaming": True, "colour_shift": True, "delay": True}
        light = traced.show(disk=disk, time=PER_FRAME * number, **switches).light
        return kc.pictures.tone_mapped(light, exposure=0.35, curve="asinh", softening=8)

    settings = {"spin": spin, "inner": inner, "radius": RADIUS, "spots": SPOTS, "size": (WIDTH, HEIGHT), "seed": SEED}
    return Film(name, settings, frames, 25, draw)
