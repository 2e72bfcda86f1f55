"""
Photon rings and critical curves
================================

Along the shadow edge of a camera at r = 6 (spin 0.9): the lensing bands of matter in the whole equatorial plane,
filled, and the critical curves of stars, as lines. Height is the number of e-foldings of the distance from the shadow
edge, which lies in the middle. Beside it the celestial sphere with the caustics, and the rim of the plane. A critical
curve meets the edge of a band exactly where its caustic crosses the rim: both are marked. Both families go deeper by
gamma from each order to the next. Beyond the paper.
"""

from pathlib import Path

import kerrcaustics as kc
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.ring_ladder import ladder_figure

CAMERA = kc.Camera(spin=0.9, radius=6.0, inclination=1.0, velocity="fiducial")


def main(output: Path) -> list[Path]:
    return write_line_art(ladder_figure(CAMERA), output, "photon_ring_ladder")


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
