"""
Caustics against spin
=====================

The first three caustics of a camera on the equator at r = 6.03, for spins from 0.3 to 0.999, on the same axes down
each column except the first, where each caustic has its own scale. The paper has no such figure.

Without spin every caustic is a point, behind the hole (odd orders) or behind the camera (even ones). With spin each
becomes an astroid and is carried along phi', by about 2 pi a / (3 sqrt 3) more with each order while the spin is small.
The secondary and tertiary ones stretch, until near a = 1 their prograde cusps wind round the sky again and again.
"""

from pathlib import Path

import kerrcaustics as kc
from kerrcaustics.draw.multiples import multiples_figure
from kerrcaustics.draw.picture_files import write_line_art

RADIUS = 6.03
SPINS = (0.3, 0.6, 0.9, 0.99, 0.999)


def main(output: Path) -> list[Path]:
    rows = {f"a = {spin}": kc.caustics(kc.Camera(spin, RADIUS), orders=3) for spin in SPINS}
    return write_line_art(multiples_figure(rows, f"radius {RADIUS}, inclination 90 deg"), output, Path(__file__).stem)


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
