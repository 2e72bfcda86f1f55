"""
The light of a hot spot
=======================

A spot on a circular orbit at r = 6 round a hole of spin 0.998, seen from r = 50, inclination 75 degrees: its light
over an orbit, and what each crossing of the plane adds to it. Triangles mark when two images of the spot are
created (up) and when two are annihilated (down). Below: the images of its orbit, crossing by crossing, where pairs are
created and annihilated, and, dashed in grey, the path of the centroid of all the light.
"""

import math
from pathlib import Path

import kerrcaustics as kc
from kerrcaustics.draw.light_curves import crowded_times, light_curve_figure
from kerrcaustics.draw.picture_files import write_picture

CAMERA = kc.Camera(spin=0.998, radius=50.0, inclination=math.radians(75), velocity="static")


def main(output: Path) -> list[Path]:
    light = kc.light_curve(CAMERA, 6.0, 400, size=0.1, crossings=3)
    # A second time, with more times where images are born and die.
    light = kc.light_curve(CAMERA, 6.0, crowded_times(light), size=0.1, crossings=3)
    return [write_picture(light_curve_figure(light), output / "spot_light_curve.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
