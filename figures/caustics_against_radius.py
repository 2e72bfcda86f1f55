"""
Caustics against radius
=======================

The first three caustics of a hole of spin 0.999 for cameras on its equator, from r = 1.5 to r = 50, on the same axes
down each column except the first, where each caustic has its own scale. The paper has no such figure.

From far away the primary caustic is small, about 0.368 a^2 / r^2 radians wide, and almost behind the hole; it keeps
its four cusps while it grows nearly a thousandfold. The secondary and tertiary ones are wide from any distance, as
they arise where light circles the hole; close in, their prograde cusps run ahead by another circuit or more.
"""

from pathlib import Path

import kerrcaustics as kc
from kerrcaustics.draw.multiples import multiples_figure
from kerrcaustics.draw.picture_files import write_line_art

SPIN = 0.999
RADII = (50.0, 15.0, 6.03, 2.6, 1.5)


def main(output: Path) -> list[Path]:
    rows = {f"r = {radius:g}": kc.caustics(kc.Camera(SPIN, radius), orders=3) for radius in RADII}
    return write_line_art(multiples_figure(rows, f"spin {SPIN}, inclination 90 deg"), output, Path(__file__).stem)


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
