"""What does leaving things out save? Microseconds on one core of rays, beams, and what can be had with them.

    kerrcaustics study cost

For each engine, rays of the whole sky of one camera at the default tolerance, captured directions not counted; each
line asks for one thing more than the line before. Whiskers tell how far two rounds differ: what is within them is
noise. Writes cost.json, cost.png and cost.md.
"""

import time
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw.style import PALETTE, RC, SMALLEST_TEXT
from kerrcaustics.report.machine import core_seconds, one_core
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table, text_table

from ..directions import whole_sky

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
ENGINES = {"closed-form": PALETTE[1], "integrated": PALETTE[0]}


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


def draw(found: dict[str, list[float]], noise: dict[str, list[float]], names: list[str]) -> Figure:
    """Bars of microseconds, a group for each scene; whiskers up to the slower round."""
    with rc_context(RC):
        figure = Figure(figsize=(4.6, 2.6), layout="constrained")
        ax = figure.subplots()
        for k, (engine, times) in enumerate(found.items()):
            for i, time in enumerate(times):
                place = i + 0.38 * (k - 0.5)
                slower = {"yerr": [[0], [noise[engine][i]]], "error_kw": {"linewidth": 0.8, "capsize": 2}}
                ax.bar(place, time, 0.36, color=ENGINES[engine], **slower)
                label = {"ha": "center", "fontsize": SMALLEST_TEXT, "textcoords": "offset points"}
                ax.annotate(f"{time:.1f}", (place, time + noise[engine][i]), (0, 2), **label)
            name = "closed form" if engine == "closed-form" else engine
            ax.annotate(name, (0.02, 0.95 - 0.09 * k), xycoords="axes fraction", color=ENGINES[engine], va="top")
        ax.set_xticks(range(len(names)), names)
        ax.set_ylabel("time on one core (µs)")
        ax.margins(y=0.12)
        ax.spines[["top", "right"]].set_visible(False)
    return figure


def findings(found: dict[str, list[float]], names: list[str]) -> list[str]:
    """What was found, a sentence for each engine."""
    return [
        f"{engine}: {times[0]:.1f} µs for {names[0]} alone, {times[-1]:.1f} µs for beams with all that was asked for."
        for engine, times in found.items()
    ]


def main(output: Path, directions: int = 24576, repeats: int = 5, scenes: tuple = SCENES) -> list[Path]:
    """Measure, write cost.json, .png and .md into a folder, and return their paths."""
    began = time.perf_counter()
    # From the first ray on: threads that start later stay on that core too.
    with one_core():
        sky = whole_sky(CAMERA, directions, np.random.default_rng(2015))
        rounds = {engine: measured(sky, engine, repeats, scenes) for engine in ENGINES}
    found, noise = ({engine: both[i] for engine, both in rounds.items()} for i in range(2))
    names = [name for name, _, _ in scenes]
    heads = ["asked for", *(head for engine in found for head in (f"{engine}, µs", "slower round"))]
    columns = [column for engine in found for column in (found[engine], np.add(found[engine], noise[engine]))]
    rows = [[name, *(f"{t:.1f}" for t in times)] for name, *times in zip(names, *columns, strict=True)]
    print(text_table(heads, rows))
    settings = {"spin": CAMERA.spin, "radius": CAMERA.radius, "directions": directions, "scenes": names}
    return write_study(
        output,
        "cost",
        __doc__,
        draw(found, noise, names),
        markdown_table(heads, rows),
        settings=settings,
        findings=findings(found, names),
        microseconds=found,
        noise=noise,
        seconds=time.perf_counter() - began,
    )
