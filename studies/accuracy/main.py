"""Error against run time: errors against studies/truth/truth.json, and times of more rays of the same families.

    kerrcaustics study accuracy

Errors of n' in radians and of delta_minus relative to delta_plus, of 400 rays whose truth is known to 25 digits; time
of a beam with Morse index, crossings and redshift on one core, of many directions drawn in the same way from the same
cameras, after a first call. In the picture 99 % of the rays are better than the dots, thin lines go from the median to
the worst ray, and the dashed line is what the rounding of the direction N to double precision costs, whatever computes
the ray. Writes accuracy.json, accuracy.png and accuracy.md.
"""

import json
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

import kerrcaustics as kc
from kerrcaustics.draw.style import PALETTE, RC, SMALLEST_TEXT
from kerrcaustics.report.machine import core_seconds, one_core
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table, text_table

from ..directions import FAMILIES

QUESTION = "How much time does a given error cost?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 17
QUICK_SECONDS = 10

TRUTH = Path(__file__).parents[1] / "truth" / "truth.json"
# (engine, tolerance); the closed form takes none.
METHODS = (
    *(("integrated", tolerance) for tolerance in (1e-6, 1e-8, 1e-10, 1e-12, 1e-13, 1e-14)),
    ("closed-form", 1e-10),
    *(("auto", tolerance) for tolerance in (1e-10, 1e-12, 1e-14)),
)
# Lines that differ little from their neighbours.
ONLY_DRAWN = {"integrated, 1e-08", "integrated, 1e-13", "auto, 1e-12"}
COLOURS = {"integrated": PALETTE[0], "closed-form": PALETTE[1], "auto": PALETTE[2]}
# N in doubles is known to this many radians; the beam magnifies it by delta_plus.
ROUNDING = 1e-16
IN_PANEL = {"xycoords": "axes fraction", "textcoords": "offset points", "fontsize": RC["font.size"]}
NAMES = {"integrated": "integrated, by tolerance", "closed-form": "closed form", "auto": "auto"}
QUANTITIES = {"direction": "error of n′ (rad)", "delta_minus": "error of δ₋ / δ₊"}
TITLES = {
    "whole sky": "whole sky",
    "near the edge": "10⁻¹ to 10⁻¹⁰ rad from the edge",
    "through the poles": "through the poles",
}
WHERE = TITLES | {"whole sky": "of the whole sky"}


class Known(NamedTuple):
    """Rays of one camera and their truth: sky (n, 3), direction (n, 3), delta_plus (n,), delta_minus (n,)."""

    camera: kc.Camera
    sky: np.ndarray
    direction: np.ndarray
    delta_plus: np.ndarray
    delta_minus: np.ndarray


def known_rays() -> dict[str, list[Known]]:
    """The rays of truth.json by family, camera by camera."""
    truth = json.loads(TRUTH.read_text(encoding="utf-8"))
    families: dict[str, list[Known]] = {}
    for family, i in dict.fromkeys((ray["family"], ray["camera"]) for ray in truth["rays"]):
        rays = [ray for ray in truth["rays"] if (ray["family"], ray["camera"]) == (family, i)]
        columns = [np.array([ray[name] for ray in rays], float) for name in Known._fields[1:]]
        families.setdefault(family, []).append(Known(kc.Camera(**truth["cameras"][i]), *columns))
    return families


def errors(known: list[Known], engine: str, tolerance: float) -> dict[str, np.ndarray]:
    """True and reported errors (rays,) of n' in radians and of delta_minus over delta_plus."""
    found: dict[str, list[np.ndarray]] = {}
    for rays in known:
        beams = kc.trace_beams(rays.camera, rays.sky, engine, tolerance)
        parts = {
            "direction": np.linalg.norm(beams.direction - rays.direction, axis=1),
            "direction reported": beams.error,
            "delta_minus": np.abs(beams.delta_minus - rays.delta_minus) / rays.delta_plus,
            "delta_minus reported": beams.diameter_error,
        }
        for name, values in parts.items():
            found.setdefault(name, []).append(values)
    return {name: np.concatenate(values) for name, values in found.items()}


def time_of_beam(samples: list[tuple[kc.Camera, np.ndarray]], engine: str, tolerance: float, repeats: int) -> float:
    """Microseconds of processor time a beam."""

    def work() -> None:
        for camera, sky in samples:
            kc.trace_beams(camera, sky, engine, tolerance)

    return 1e6 * core_seconds(work, repeats) / sum(len(sky) for _, sky in samples)


def measured(
    known: list[Known], samples: list[tuple[kc.Camera, np.ndarray]], engine: str, tolerance: float, repeats: int
) -> dict:
    """A point of the diagram: time, and quantiles of the errors and of true over reported error."""
    found = errors(known, engine, tolerance)
    entry = {
        "engine": engine,
        "tolerance": tolerance,
        "microseconds": time_of_beam(samples, engine, tolerance, repeats),
    }
    for name in QUANTITIES:
        true, reported = found[name], found[f"{name} reported"]
        entry[name] = {
            **{"median": np.median(true), "q99": np.quantile(true, 0.99), "largest": true.max()},
            **{"reported_median": np.median(reported), "reported_q99": np.quantile(reported, 0.99)},
            "largest_ratio": np.max(true / reported),
        }
    return entry


def line_name(point: dict) -> str:
    """Name of a line of the tables."""
    return point["engine"] if point["engine"] == "closed-form" else f"{point['engine']}, {point['tolerance']:.0e}"


def table(points: list[dict]) -> tuple[list[str], list[list[str]]]:
    heads = ["engine, tolerance", "µs a beam", "n′: median", "99 %", "largest", "true / reported", "of δ₋/δ₊"]
    rows = []
    for point in points:
        if line_name(point) in ONLY_DRAWN:
            continue
        n, minor = point["direction"], point["delta_minus"]
        rows.append(
            [
                line_name(point),
                f"{point['microseconds']:.1f}",
                *(f"{n[name]:.0e}" for name in ("median", "q99", "largest")),
                f"{n['largest_ratio']:.2g}",
                f"{minor['largest_ratio']:.2g}",
            ]
        )
    return heads, rows


def findings(found: dict[str, list[dict]]) -> list[str]:
    """Findings, in sentences: the default engine in each family, and how honest the reported errors are."""
    sentences = []
    for family, points in found.items():
        default = next((point for point in points if line_name(point) == "auto, 1e-10"), points[0])
        n = default["direction"]
        where = f"Rays {WHERE[family]}, {line_name(default)}: {default['microseconds']:.1f} µs a beam"
        sizes = f"{n['median']:.0e} rad in the median, {n['q99']:.0e} for 99 %, {n['largest']:.0e} at most"
        sentences.append(f"{where}, errors of n′ {sizes}.")
    ratios = {q: max(p[q]["largest_ratio"] for points in found.values() for p in points) for q in QUANTITIES}
    of_n, of_minor = (f"{ratio:.2g}" for ratio in ratios.values())
    return [*sentences, f"True errors are at most {of_n} (n′) and {of_minor} (δ₋ / δ₊) times the reported ones."]


def draw(found: dict[str, list[dict]], floors: dict[str, float]) -> Figure:
    """Error against time, a column for each family, rows for n' and delta_minus."""
    times = [p["microseconds"] for points in found.values() for p in points]
    with rc_context(RC):
        figure = Figure(figsize=(7.0, 5.2), layout="constrained")
        panels = figure.subplots(len(QUANTITIES), len(found), sharex=True, sharey="row", squeeze=False)
        for row, (quantity, label) in zip(panels, QUANTITIES.items(), strict=True):
            row[0].set_ylabel(label)
            for ax, (family, points) in zip(row, found.items(), strict=True):
                for engine in {point["engine"]: None for point in points}:
                    draw_engine(ax, [p for p in points if p["engine"] == engine], quantity, named=ax is panels[0, 0])
                ax.set(xscale="log", yscale="log", xlim=(min(times) / 2.6, max(times) * 2))
                ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
                ax.xaxis.set_major_formatter(lambda time, _: f"{time:g}")
                ax.xaxis.set_minor_locator(NullLocator())
                ax.grid(color="#e8e8e8", linewidth=0.5)
                if ax in panels[0]:
                    ax.set_title(TITLES[family])
        for ax, floor in zip(panels[0], floors.values(), strict=True):
            ax.axhline(floor, color="#888888", linewidth=0.8, linestyle=(0, (4, 3)), zorder=0)
        # In the panel and between the points where the most room is.
        near = np.sort([p["microseconds"] for p in found["near the edge"]])
        widest = int(np.argmax(near[1:] / near[:-1]))
        middle = float(np.sqrt(near[widest] * near[widest + 1]))
        style = {"textcoords": "offset points", "fontsize": SMALLEST_TEXT, "color": "#777777", "ha": "center"}
        panels[0, 1].annotate("rounding of N", (middle, floors["near the edge"]), (0, 3), **style)
        figure.supxlabel("time of a beam on one core (µs)", fontsize=RC["axes.labelsize"])
    return figure


def draw_engine(ax: Axes, points: list[dict], quantity: str, named: bool) -> None:
    """99 % errors as dots joined by a line, and a thin line from the median to the largest error of each."""
    engine, times = points[0]["engine"], [p["microseconds"] for p in points]
    colour = COLOURS[engine]
    values = {name: [p[quantity][name] for p in points] for name in ("median", "q99", "largest")}
    ax.vlines(times, values["median"], values["largest"], color=colour, linewidth=0.8, alpha=0.5)
    face = "white" if engine == "auto" else colour
    ax.plot(times, values["q99"], "o-", color=colour, markersize=4.5 if engine == "auto" else 3.5, mfc=face)
    if not named:
        return
    # Names in their colours, where no error can be: a beam is not both slow and as wrong as that.
    line = list(COLOURS).index(engine)
    ax.annotate(NAMES[engine], (0.97, 0.95), (0, -11 * line), color=colour, ha="right", va="top", **IN_PANEL)
    if engine == "integrated":
        # The loosest tolerances need the same steps; the tightest lie close together.
        for point, time, value in list(zip(points, times, values["q99"], strict=True))[1:3]:
            power = round(np.log10(point["tolerance"]))
            label = f"$10^{{{power}}}$"
            ax.annotate(label, (time, value), (5, 0), color=colour, textcoords="offset points", fontsize=SMALLEST_TEXT)


QUICK: dict[str, Any] = {"directions": 2048, "repeats": 1}
"""Arguments of `main` for a quick run."""


def main(output: Path, directions: int = 24576, repeats: int = 3, methods: tuple = METHODS) -> list[Path]:
    """Measure, write accuracy.json, .png and .md into a folder, and return their paths."""
    began = time.perf_counter()
    rng, known = np.random.default_rng(2015), known_rays()
    found: dict[str, list[dict]] = {}
    for family, rays in known.items():
        total = sum(len(part.sky) for part in rays)
        # From the first ray on: threads that start later stay on that core too.
        with one_core():
            samples = [
                (part.camera, FAMILIES[family](part.camera, directions * len(part.sky) // total, rng)) for part in rays
            ]
            found[family] = [measured(rays, samples, *method, repeats) for method in methods]
        print(f"{family}\n{text_table(*table(found[family]))}")
    floors = {
        family: ROUNDING * float(np.quantile(np.concatenate([part.delta_plus for part in rays]), 0.99))
        for family, rays in known.items()
    }
    settings = {"truth": "studies/truth/truth.json", "directions": directions}
    pages = "".join(f"**{TITLES[family]}**\n\n{markdown_table(*table(points))}\n" for family, points in found.items())
    return write_study(
        output,
        "accuracy",
        __doc__,
        draw(found, floors),
        pages,
        settings=settings,
        findings=findings(found),
        rounding=floors,
        families=found,
        seconds=time.perf_counter() - began,
    )
