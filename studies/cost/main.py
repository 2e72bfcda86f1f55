"""Run time of rays and beams with their options, of what users wait for, and of the first use.

    kerrcaustics study cost

For each engine, rays of the whole sky of one camera at the default tolerance, captured directions not counted; each
line asks for one thing more than the line before. Whiskers show how far two rounds differ: what is within them is
noise.

Each line of what people wait for runs in a process of its own: a first call, on all cores; then more calls, each for
another camera, of which the fastest is shown, in processor time on one core. Tracing is the time within kernels, the
rest is Python and NumPy. The whole is compared with what as many rays and beams take by the first table, with all that
can be had with them: absolute times are noise, ratios less so. A process on all cores would be as many times as fast as
there are cores, but for what waits there: for the interpreter's lock, or for a step that only one thread takes.

The first use is a new process until it has its answer: its start with all imports, then its first call. Writes
cost.json, cost.png and cost.md.
"""

import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.trace import cores
from kerrcaustics.report.machine import core_seconds, one_core
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table, text_table

from ..directions import whole_sky
from .lines import LINES, SIZES, Sizes, line
from .picture import ENGINES, draw

QUESTION = "Where does the time go?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 51
QUICK_SECONDS = 19

CAMERA = kc.Camera(0.999, 6.03)
_NOTHING = {"index": False, "crossings": False, "redshift": False}
# (name, beams or rays, options): each with one thing more than the one before.
SCENES = (
    ("rays", False, {}),
    ("beams", True, _NOTHING),
    ("+ index", True, _NOTHING | {"index": True}),
    ("+ crossings", True, _NOTHING | {"index": True, "crossings": True}),
    ("+ redshift", True, {}),
    ("+ time", True, {"time": True}),
)
Rows = tuple[list[str], list[list[str]]]
FIRST_USED = ("first star", "three caustics")


def measured(sky: np.ndarray, engine: str, repeats: int, scenes: tuple) -> tuple[list[float], list[float]]:
    """Microseconds a ray of each scene, the lesser of two rounds, and by how much the rounds differ."""
    rounds = []
    # All scenes in turn, twice: what the machine does besides then shows as a difference.
    for _ in range(2):
        times = []
        for _, beams, options in scenes:
            trace = kc.trace_beams if beams else kc.trace_rays
            times.append(core_seconds(lambda t=trace, o=options: t(CAMERA, sky, engine, **o), repeats))
        rounds.append(times)
    microseconds = 1e6 * np.array(rounds) / len(sky)
    return microseconds.min(axis=0).tolist(), np.ptp(microseconds, axis=0).tolist()


def compared(name: str, sizes: Sizes, repeats: int, each: tuple[float, float]) -> dict[str, Any]:
    """A line, and how many times as long it takes as its rays and beams alone, at microseconds of each."""
    found = line(name, sizes, repeats)
    alone = 1e-6 * (each[0] * found["traced"]["rays"] + each[1] * found["traced"]["beams"])
    return found | {"ratio": sum(found["later"].values()) / alone}


def findings(found: dict[str, list[float]], names: list[str], lines: dict, first: dict) -> list[str]:
    """Findings: a sentence for each engine, one of the lines, one for each first use."""
    sentences = [
        f"{engine}: {times[0]:.2f} µs for {names[0]} alone, {times[-1]:.2f} µs for beams with all that was asked for."
        for engine, times in found.items()
    ]
    if lines:
        ratios = sorted((one["ratio"], name) for name, one in lines.items())
        (least, first_name), (most, last_name) = ratios[0], ratios[-1]
        sentences.append(
            f"What people wait for takes {in_words(least)} ({first_name}) to {in_words(most)} times ({last_name}) as "
            "long as its rays and beams alone."
        )
    for name, stages in first.items():
        sentences.append(
            f"First use, {name}: {sum(stages.values()):.1f} s, of which the start takes {stages['start']:.1f} s."
        )
    return sentences


def beam_table(found: dict[str, list[float]], names: list[str]) -> Rows:
    """Microseconds of rays and beams, by engine."""
    heads = ["asked for", *(f"{engine}, µs" for engine in found)]
    return heads, [[name, *(f"{t:.2f}" for t in times)] for name, *times in zip(names, *found.values(), strict=True)]


def line_table(lines: dict[str, dict[str, Any]]) -> Rows:
    """Times of the lines, of which the first calls are in seconds and the others in milliseconds."""
    heads = ["line", "first call, s", "later call, ms", "tracing, ms", "rays", "beams", "× these alone"]
    rows = []
    for name, one in lines.items():
        first, later = one["first"], one["later"]
        times = (milliseconds(t) for t in (sum(later.values()), later["tracing"]))
        numbers = (str(one["traced"][kind]) for kind in ("rays", "beams"))
        first_call = f"{sum(first.values()) - first['start']:.2f}"
        rows.append([name, first_call, *times, *numbers, in_words(one["ratio"]), f"{one['speed_up']:.1f}"])
    return [*heads, f"speed-up on {cores()} cores"], rows


def first_table(first: dict[str, dict[str, float]]) -> Rows:
    """Seconds of the first use, by stage."""
    stages = {"start": "start, imports", "tracing": "tracing", "rest": "rest"}
    rows = [[name, *(f"{t:.2f}" for t in (sum(one.values()), *map(one.get, stages)))] for name, one in first.items()]
    return ["first use", "until its answer, s", *(f"{head}, s" for head in stages.values())], rows


def milliseconds(seconds: float) -> str:
    """Seconds as milliseconds."""
    return in_words(1e3 * seconds)


def in_words(number: float) -> str:
    """A number with one digit after the point, if it is below a hundred."""
    return f"{number:.{1 if number < 100 else 0}f}"


QUICK: dict[str, Any] = {
    "directions": 4096,
    "repeats": 1,
    "lines": ("first star", "one more star", "three caustics", "tracks of a star", "frame of a disk"),
    "calls": 1,
}
"""Arguments of `main` for a quick run."""


def main(
    output: Path,
    directions: int = 24576,
    repeats: int = 5,
    scenes: tuple = SCENES,
    lines: tuple[str, ...] = tuple(LINES),
    sizes: Sizes = SIZES,
    calls: int = 3,
    first: tuple[str, ...] = FIRST_USED,
) -> list[Path]:
    """Measure, write cost.json, .png and .md into a folder, and return their paths."""
    began = time.perf_counter()
    # From the first ray on: threads that start later stay on that core too.
    with one_core():
        sky = whole_sky(CAMERA, directions, np.random.default_rng(2015))
        rounds = {engine: measured(sky, engine, repeats, scenes) for engine in ENGINES}
    found, noise = ({engine: both[i] for engine, both in rounds.items()} for i in range(2))
    names = [name for name, _, _ in scenes]
    each = found["closed-form"][0], found["closed-form"][-1]
    of_lines = {name.format(**asdict(sizes)): compared(name, sizes, calls, each) for name in lines}
    of_first = {name: of_lines[name]["first"] for name in first}
    tables = [beam_table(found, names), line_table(of_lines), first_table(of_first)]
    tables = [table for table in tables if table[1]]
    print("\n".join(text_table(*table) for table in tables))
    settings = {"spin": CAMERA.spin, "radius": CAMERA.radius, "directions": directions, "scenes": names}
    return write_study(
        output,
        "cost",
        __doc__,
        draw(found, noise, names, of_lines, of_first),
        "\n".join(markdown_table(*table) for table in tables),
        settings=settings | {"lines": list(of_lines), "sizes": asdict(sizes)},
        findings=findings(found, names, of_lines, of_first),
        microseconds=found,
        noise=noise,
        lines=of_lines,
        first_use=of_first,
        seconds=time.perf_counter() - began,
    )
