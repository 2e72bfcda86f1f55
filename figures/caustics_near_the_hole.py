"""
Critical curves and caustics
============================

The first three critical curves on the camera sky and their caustics on the celestial sphere, for cameras on circular
orbits at r = 6.03 and r = 2.6 round a hole of spin 0.999, and for a camera at an inclination of 60 degrees (spin 0.95,
r = 4). Letters mark matching points: the cusps. Remakes JTFT figure 9 (r = 2.6), and the curves of figures 5 (r = 6.03)
and 8.

The paper's: hole and cameras on the equator, the pairs of curves, matching letters. Ours: the letters are at the cusps,
in order along the curve; the primary pair beside the others, the unrolled view, and the inclined camera.

At r = 6.03 the primary caustic is an astroid 0.42 by 0.45 degrees wide, not far from the point behind the hole; the
secondary one spans 0.73 of a circuit and the tertiary winds 5.2 times round the sky. At r = 2.6 these are 1.8 by 2.1
degrees, one full circuit, and more than six, as the paper has it.
"""

import math
from pathlib import Path

import kerrcaustics as kc
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.plots import overview

CAMERAS = {
    "caustics_r6.03": kc.Camera(spin=0.999, radius=6.03),
    "caustics_r2.6": kc.Camera(spin=0.999, radius=2.6),
    "caustics_inclined": kc.Camera(spin=0.95, radius=4.0, inclination=math.radians(60)),
}


def main(output: Path) -> list[Path]:
    files = []
    for name, camera in CAMERAS.items():
        picture = overview(kc.caustics(camera, orders=3), kc.shadow_edge(camera, 6000))
        files += write_line_art(picture, output, name)
    return files


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
