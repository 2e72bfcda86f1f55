"""Error against run time, for every result: true errors, and the processor time of one core.

    kerrcaustics study error_time

Each result is computed with several settings, where there are any: tolerances, points, nodes, qualities. Its true error
is that against rays of 25 digits, images in quadruple precision, folds and cusps in long arithmetic, closed forms of
holes without spin, sums over partial waves and separated modes, or slow sums over rays; "against" says which. The table
has the largest error of all values, of rays that of 99 %, with the largest reported one, and the largest ratio of true
to reported error of any value; "below" marks a difference that the truth's own error explains. Times are those of one
result on one core after a first call: one ray, one more star of a camera, one caustic search for a new camera, one
curve, one frame. In the picture settings of a result are joined. Writes error_time.json, error_time.png and
error_time.md.
"""

import math
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from kerrcaustics.report.machine import one_core
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table, text_table

from . import disks, frames, sources, stars, traced
from .picture import draw
from .points import SIZES, Point, Result, Sizes

QUESTION = "What does an error of each result cost?"
# Run times on two cores of an AMD EPYC (2.6 GHz, shared).
SECONDS = 100
QUICK_SECONDS = 40

RESULTS = (*traced.RESULTS, *stars.RESULTS, *sources.RESULTS, *disks.RESULTS, *frames.RESULTS)
QUICK: dict[str, Any] = {
    "sizes": Sizes(
        repeats=1,
        directions=2048,
        tolerances=(1e-6, 1e-10, 1e-14),
        stars=3,
        times=10,
        spot_points=1024,
        frequencies=(1.0, 2.0),
        pixels=45,
        side=11,
        twin=240,
        rings=400,
        balls=(0.01,),
        places=3,
    )
}
"""Settings of the quick study."""
# The line with which README and overview compare the times of all others, and its setting.
UNIT = "beam", "closed form"
UNITS = (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6))


def heads() -> list[str]:
    """Heads of the table."""
    return ["result", "setting", "time", "in beams", "true error", "reported", "true / reported", "of", "against"]


def rows(points: list[Point]) -> list[list[str]]:
    """The table, a row for each point; what all settings of a result share stands in its first row."""
    beam = beam_seconds(points)
    found, before = [], ""
    for point in points:
        first, before = point.line != before, point.line
        name, quantity, against = (point.line, point.quantity, point.against) if first else ("", "", "")
        ratio = "" if math.isnan(point.ratio) else f"{point.ratio:.2g}"
        reported = "" if math.isnan(point.reported) else f"{point.reported:.0e}"
        true = f"{'below ' if point.bound else ''}{point.error:.0e}"
        times = duration(point.seconds), in_beams(point.seconds / beam)
        found.append([name, point.setting, *times, true, reported, ratio, quantity, against])
    return found


def beam_seconds(points: list[Point]) -> float:
    """Seconds of one beam; those of the quickest result where there is none."""
    beams = [point.seconds for point in points if (point.line, point.setting) == UNIT]
    return beams[0] if beams else min(point.seconds for point in points)


def in_beams(ratio: float) -> str:
    """A time in beams, to two digits."""
    if ratio < 10:
        return f"{ratio:.2g}"
    return f"{round(ratio, 1 - math.floor(math.log10(ratio))):,.0f}"


def duration(seconds: float) -> str:
    """Seconds with a unit, to two digits."""
    unit, size = next(pair for pair in UNITS if seconds >= 0.9995 * pair[1] or pair is UNITS[-1])
    value = seconds / size
    return f"{value:.{0 if value >= 10 else 1 if value >= 1 else 2}f} {unit}"


def findings(points: list[Point]) -> list[str]:
    """Findings: honesty of the errors, and the span of times and errors."""
    ratios = [(point.ratio, point) for point in points if math.isfinite(point.ratio)]
    most, worst = max(ratios, key=lambda pair: pair[0])
    beam, last = beam_seconds(points), max(points, key=lambda point: point.seconds)
    above = sum(ratio > 1 for ratio, _ in ratios)
    return [
        f"Of {len(ratios)} settings with a reported error, {above} have a value whose true error is larger; the "
        f"largest ratio of true to reported error is {most:.2g} ({worst.line}, {worst.setting}).",
        f"A beam takes {duration(beam)}; what takes longest, {last.line} ({last.setting}), as long as "
        f"{in_beams(last.seconds / beam)} beams.",
    ]


def main(output: Path, results: tuple[Result, ...] = RESULTS, sizes: Sizes = SIZES) -> list[Path]:
    """Measure, write error_time.json, .png and .md into a folder, and return their paths."""
    began = time.perf_counter()
    points: list[Point] = []
    # From the first ray on: threads that start later stay on that core too.
    with one_core():
        for result in results:
            points += result.measured(sizes)
    table = heads(), rows(points)
    print(text_table(*table))
    return write_study(
        output,
        "error_time",
        __doc__ or "",
        draw(points, beam_seconds(points)),
        markdown_table(*table),
        settings={"results": list(dict.fromkeys(point.line for point in points)), **asdict(sizes)},
        findings=findings(points),
        points=[asdict(point) for point in points],
        seconds=time.perf_counter() - began,
    )
