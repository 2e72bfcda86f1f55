"""
The number of images of a star
==============================

The number of images of index 0 to 2 of a star, by its place on the celestial sphere, with the caustics, for a = 0.999
and cameras on the equator at r = 6.03 and r = 2.6. The paper has no such figure.

Across the primary and the secondary caustic the count changes by two. Across the tertiary one it changes by one,
because the partner has index 3 and is not counted.
"""

from pathlib import Path

import kerrcaustics as kc
from kerrcaustics.draw.count_map import count_map_figure
from kerrcaustics.draw.picture_files import write_line_art

SPIN = 0.999
RADII = (6.03, 2.6)
ROWS = 360


def main(output: Path) -> list[Path]:
    files = []
    maps = {radius: kc.count_map(kc.Camera(SPIN, radius), max_index=2, rows=ROWS) for radius in RADII}
    # One colour a count in all of them.
    most = max(int(counts.counts.sum(axis=2).max()) for counts in maps.values())
    for radius, counts in maps.items():
        picture = count_map_figure(counts, kc.caustics(kc.Camera(SPIN, radius), orders=3), most)
        files += write_line_art(picture, output, f"count_map_r{radius}")
    return files


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
