"""Five questions that JTFT leaves open, settled with numbers: tracks, pairs, orders, counts, the camera's velocity.

    kerrcaustics study open_questions

1. Does the order-1 track of a star cross the tertiary critical curve? 2. Does every crossing of a caustic from outside
to inside create a pair? 3. Where do the original images of order eps end up? 4. How many images lie between critical
curves near the flat edge of the shadow? 5. Does the camera's velocity change anything beyond aberration? The numbers
come from crossings.py, pairs.py, counts.py, velocity.py. In the picture, left: polar phase of the
rays of each critical curve, whose whole numbers are crossings of the equatorial plane; right: images of index 2 of a
star on the celestial equator, white where not every image was found. Writes open_questions.json, .png and .md.
"""

import math
import time
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw.style import GUIDE_COLOUR, PAGE_WIDTH, PALETTE, RC, order_colour, order_name
from kerrcaustics.images.search import search
from kerrcaustics.images.sheets import sheets_of
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table

from .counts import PLACES, EquatorialImages, circle_crossings, equatorial_images, half_turn_gaps, line_between
from .crossings import CriticalCrossings, critical_crossings, crossings_by_index, lives
from .pairs import crossings_of
from .velocity import critical_misses, image_misses, moving

QUESTION = "What answers have the paper's open questions?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 62
QUICK_SECONDS = 13

Array = np.ndarray
Answer = dict[str, Any]

# (spin, radius, inclination in degrees).
NEAR, FAR = (0.999, 2.6, 90), (0.999, 6.03, 90)
CRITICAL = (NEAR, FAR, (0.999, 50, 90), (0.9, 3, 90), (0.9, 10, 90), (0.6, 2.6, 90), (0.6, 6.03, 90), (0.999, 6.03, 60))
CAUSTICS = (NEAR, FAR, (0.9, 3, 90), (0.6, 10, 90), (0.999, 6.03, 60))
ORBITS = (NEAR, FAR, (0.9, 3, 90), (0.6, 10, 90))
COUNTED = (NEAR, FAR)
EVENTS = (NEAR, FAR, (0.999, 6.03, 60))

_MAX_INDEX = 2
_DISTANCES = (1e-4, 1e-6)
_LINES = {"flat edge (prograde)": 0.0, "above": math.pi / 2, "retrograde edge": math.pi, "below": 3 * math.pi / 2}
_POINTS_OF_A_LINE = 2000


def camera_of(place: tuple[float, float, float]) -> kc.Camera:
    """The camera at rest with respect to the FIDO: none of this depends on its velocity, says question 5."""
    spin, radius, inclination = place
    return kc.Camera(spin, radius, math.pi / 2 if inclination == 90 else math.radians(inclination), "fiducial")


def name_of(place: tuple[float, float, float]) -> str:
    spin, radius, inclination = place
    return f"{spin:g}, {radius:g}" + ("" if inclination == 90 else f", {inclination:g}°")


def question_1(curves: dict[str, list[CriticalCrossings]]) -> tuple[list[Answer], str]:
    """Crossings of the equatorial plane along critical curves."""
    answers, rows = [], []
    for name, found in curves.items():
        crossings, least = [], []
        for curve in found:
            kinds = [int(k) for k in np.unique(curve.crossings) if k >= 0]
            theta = {k: np.degrees(curve.theta[curve.crossings == k]) for k in kinds}
            extents = {k: [float(t.min()), float(t.max())] for k, t in theta.items()}
            phase = [float(curve.phase.min()), float(curve.phase.max())]
            entry = {"camera": name, "order": curve.order, "points": len(curve.theta), "theta_by_crossings": extents}
            answers.append(entry | {"in_plane": int((curve.crossings < 0).sum()), "phase": phase})
            crossings.append(" and ".join(map(str, kinds)))
            least.append(f"{phase[0]:.4f}")
        total = sum(len(curve.theta) for curve in found)
        rows.append([name, str(total), "; ".join(crossings), "; ".join(least)])
    heads = ["camera a, r", "points", "crossings, order by order", "least polar phase, half oscillations"]
    return answers, markdown_table(heads, rows)


def question_2(places: tuple, points: int, rng: np.random.Generator) -> tuple[list[Answer], str]:
    """Pairs at random points of caustics."""
    answers, rows = [], []
    for place in places:
        sheets = sheets_of(camera_of(place), _MAX_INDEX)
        kept: dict[float, list[Answer]] = {part: [] for part in _DISTANCES}
        for order in range(1, _MAX_INDEX + 2):
            for part, one in zip(_DISTANCES, crossings_of(sheets, order, points, _DISTANCES, rng), strict=True):
                ratio = (one.away / one.fold[:, None])[one.is_pair]
                entry = {"camera": name_of(place), "order": order, "part": part, "distance": float(one.distance)}
                entry |= {"points": len(one.fold), "alone": int(one.alone.sum()), "pairs": int(one.is_pair.sum())}
                spread = [float(ratio.min()), float(ratio.max())] if ratio.size else [math.nan, math.nan]
                answers.append(entry | {"other": int((one.alone & ~one.is_pair).sum()), "away_by_fold": spread})
                kept[part].append(answers[-1])
        rows.append([name_of(place), *(cell for of_part in kept.values() for cell in _pairs_in_words(of_part))])
    heads = ["camera a, r"]
    for part in _DISTANCES:
        heads += [f"pairs at {part:.0e}", "distance of images / fold's"]
    return answers, markdown_table(heads, rows)


def _pairs_in_words(answers: list[Answer]) -> list[str]:
    """The number of pairs at the caustics of one camera, and the least and the largest distance of their images."""
    pairs, alone = (sum(one[key] for one in answers) for key in ("pairs", "alone"))
    spread = np.array([one["away_by_fold"] for one in answers])
    return [f"{pairs} of {alone}", f"{np.nanmin(spread):.3f} to {np.nanmax(spread):.3f}"]


def question_3(places: tuple, stars: int, thetas: tuple, rng: np.random.Generator) -> tuple[list[Answer], str, str]:
    """Crossings and index of images of random stars; lives of images over the orbit."""
    answers, rows, lines = [], [], []
    for place in places:
        camera = camera_of(place)
        sheets = sheets_of(camera, _MAX_INDEX)
        star = _unit(rng.normal(size=(stars, 3)))
        found = search(sheets, star)
        table = crossings_by_index(camera, found, stars)[found.certified]
        whole = range(min(table.shape[1], _MAX_INDEX))
        excess = [table[:, e, e] - table[:, e].sum(axis=1) + table[:, e, e] for e in whole]
        entry = {"camera": name_of(place), "stars": stars, "certified": len(table), "images": table.sum(axis=0)}
        entry |= {"excess": [[int(e.min()), int(e.max())] for e in excess], "lives": {}}
        by_order = [[f"{n} of index {k}" for k, n in enumerate(counts) if n] for counts in entry["images"]]
        rows.append([name_of(place), str(len(table)), *(", ".join(cells) or "none" for cells in by_order)])
        for theta in thetas:
            found_lives = lives(sheets, math.radians(theta))
            entry["lives"][f"{theta:g}"] = [vars(life) for life in found_lives]
            cells = []
            for crossings in range(1, _MAX_INDEX + 1):
                here = [life for life in found_lives if life.crossings == crossings]
                texts = [f"{x.index}: {'for ever' if x.closed else f'{x.circuits:.3f}'}" for x in here]
                cells.append(", ".join(texts) or "none")
            lines.append([name_of(place), f"{theta:g}°", *cells])
        answers.append(entry)
    heads = ["camera a, r", "stars", *(f"order {k}" for k in range(_MAX_INDEX + 1))]
    life_heads = ["camera a, r", "θ′ of the star", *(f"order {k}" for k in range(1, _MAX_INDEX + 1))]
    return answers, markdown_table(heads, rows), markdown_table(life_heads, lines)


def question_4(
    places: tuple, normals: int, steps: int, rng: np.random.Generator
) -> tuple[list[Answer], str, str, list]:
    """Images of great circles across lines between critical curves; images of equatorial stars."""
    answers, rows, lines, kept = [], [], [], []
    circles = _unit(rng.normal(size=(normals, 3)))
    for place in places:
        sheets = sheets_of(camera_of(place), _MAX_INDEX)
        circular = kc.Camera(*place[:2])
        entry: Answer = {"camera": name_of(place), "lines": [], "stars": steps, "equatorial": []}
        for name, turn in _LINES.items():
            cells = []
            for index in range(1, _MAX_INDEX + 1):
                sky, image, azimuth = line_between(sheets, turn, index, _POINTS_OF_A_LINE)
                shares = np.bincount(circle_crossings(image, circles)) / normals
                swept = abs(azimuth[-1] - azimuth[0]) / (2 * math.pi)
                gaps = half_turn_gaps(circular, sheets, sky, azimuth)
                entry["lines"].append({"line": name, "index": index, "turns": swept, "shares": shares, "gaps": gaps})
                text = ", ".join(f"{n} ({_percent(share)})" for n, share in enumerate(shares) if share > 0)
                cells += [f"{swept:.3f}", text]
            rows.append([name_of(place), name, *cells])
        found = equatorial_images(sheets, steps)
        kept.append(found)
        entry["certified"] = int(found.certified.sum())
        sure = found.counts[found.certified]
        for index in range(_MAX_INDEX + 1):
            kinds, number = np.unique(sure[:, index], axis=0, return_counts=True)
            cells = []
            for kind, count in zip(kinds, number, strict=True):
                share = _percent(count / max(len(sure), 1))
                entry["equatorial"].append({"index": index, "images": kind, "stars": count})
                cells.append(f"{' + '.join(map(str, kind))} ({share})")
            lines.append([name_of(place), str(index), ", ".join(cells)])
        answers.append(entry)
    heads = ["camera a, r", "line"]
    for index in range(1, _MAX_INDEX + 1):
        heads += [f"index {index}: turns of φ′", "images of a circle (share of circles)"]
    star_heads = ["camera a, r", "index", f"images {' + '.join(PLACES)} (share of φ′)"]
    return answers, markdown_table(heads, rows), markdown_table(star_heads, lines), kept


def question_5(places: tuple, points: int, rng: np.random.Generator) -> tuple[list[Answer], str]:
    """Critical points and images found by moving cameras."""
    answers, rows = [], []
    for place in places:
        camera = camera_of(place)
        sheets = sheets_of(camera, _MAX_INDEX)
        resting = kc.caustics(camera, _MAX_INDEX + 1)
        for other in moving(camera, 2, rng):
            miss, error = critical_misses(sheets, other, points, rng)
            image_miss, image_error, lost = image_misses(sheets, other, _unit(rng.normal(size=(points, 3))))
            cusps = [_cusp_miss(other, caustic, moved) for caustic, moved in
                     zip(resting, kc.caustics(other, _MAX_INDEX + 1), strict=True)]  # fmt: skip
            entry = {"camera": name_of(place), "velocity": other.velocity, "speed": math.hypot(*other.fido_velocity())}
            entry |= {"points": len(miss), "miss": miss.max(), "miss_by_error": (miss / error).max()}
            entry |= {"images": len(image_miss), "image_miss": image_miss.max(), "lost": lost}
            entry |= {"image_miss_by_error": (image_miss / image_error).max(), "cusps_by_error": max(cusps)}
            answers.append(entry)
            name = other.velocity if isinstance(other.velocity, str) else "random"
            ratios = [f"{entry[key]:.2f}" for key in ("miss_by_error", "cusps_by_error", "image_miss_by_error")]
            rows.append([name_of(place), f"{name}, {entry['speed']:.2f}", *ratios])
    heads = ["camera a, r", "velocity", "caustic points / error", "cusps / error", "images / error"]
    return answers, markdown_table(heads, rows)


def _cusp_miss(moving: kc.Camera, resting: kc.Caustic, moved: kc.Caustic) -> float:
    """Largest distance, in errors, of the resting camera's cusps from n' of the moving camera's beams there."""
    sky = np.array([cusp.sky for cusp in moved.cusps])
    beams = kc.trace_beams(moving, sky, "auto", 1e-12, index=False, crossings=False, redshift=False)
    theta, phi = np.array([cusp.celestial for cusp in resting.cusps]).T
    place = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    error = beams.error + np.array([cusp.error for cusp in resting.cusps])
    return float((np.linalg.norm(beams.direction - place, axis=1) / error).max())


def findings(answers: dict[str, list[Answer]]) -> list[str]:
    """Findings, a sentence for each question that has a short answer."""
    level = [one for one in answers["order_1_track"] if "°" not in one["camera"]]
    tied = sum(list(one["theta_by_crossings"]) == [one["order"] - 1] for one in level)
    near = [one for one in answers["pairs"] if one["part"] == min(_DISTANCES)]
    alone, pairs = (sum(one[key] for one in near) for key in ("alone", "pairs"))
    stars, sure = (sum(one[key] for one in answers["counts"]) for key in ("stars", "certified"))
    miss = max(one[key] for one in answers["velocity"] for key in ("miss_by_error", "image_miss_by_error"))
    return [
        f"On {tied} of {len(level)} critical curves of cameras on the equator, every ray of order k crosses the "
        "equatorial plane k − 1 times and no more.",
        f"{pairs} of {alone} crossings of one caustic alone, close to it, created exactly one pair of images.",
        f"All images were found, and certified, of {sure} of {stars} stars on the celestial equator.",
        "Moving cameras find critical points and images where aberration puts those of a camera at rest, to "
        f"{miss:.2g} times their error.",
    ]


def draw(curves: list[CriticalCrossings], equatorial: EquatorialImages, place: tuple) -> Figure:
    """Polar phase along critical curves; images of an equatorial star against its phi'."""
    with rc_context(RC):
        figure = Figure(figsize=(PAGE_WIDTH, 3.1), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.25))
        _draw_phases(left, curves)
        _draw_images(right, equatorial, place)
    return figure


def _draw_phases(ax: Axes, curves: list[CriticalCrossings]) -> None:
    for curve in curves:
        ax.plot(np.degrees(curve.theta), curve.phase, ".", markersize=1.6, color=order_colour(curve.order))
        ax.annotate(order_name(curve.order), (4, curve.order - 0.82), color=order_colour(curve.order), va="center")
        text = f"{curve.order - 1} crossing" + ("" if curve.order == 2 else "s")
        ax.annotate(text, (176, curve.order - 0.82), color="#555555", ha="right", va="center")
    for line in range(len(curves) + 1):
        ax.axhline(line, color=GUIDE_COLOUR, linewidth=0.6, zorder=0)
    ax.set(xlim=(0, 180), xticks=range(0, 181, 45), yticks=range(len(curves) + 1))
    ax.set(xlabel="θ′ of the caustic's point (degrees)", ylabel="polar phase (half oscillations)")
    ax.set_title("Rays of the critical curves")
    ax.spines[["top", "right"]].set_visible(False)


def _draw_images(ax: Axes, found: EquatorialImages, place: tuple) -> None:
    phi, counts = np.degrees(found.phi), np.where(found.certified[:, None], found.counts[:, _MAX_INDEX], 0)
    base = np.zeros(len(phi))
    step = 360 / len(phi)
    for k, (name, colour) in enumerate(zip(PLACES, (PALETTE[0], PALETTE[5], PALETTE[1]), strict=True)):
        ax.bar(phi, counts[:, k], step, base, color=colour, linewidth=0, label=name)
        base += counts[:, k]
    ax.set(xlim=(0, 360), xticks=range(0, 361, 60), ylim=(0, base.max() * 1.35 + 1))
    ax.set(xlabel="φ′ of the star (degrees)", ylabel=f"images of index {_MAX_INDEX} (white: not all found)")
    ax.set_title(f"Images of an equatorial star, a = {place[0]:g}, r = {place[1]:g}")
    ax.legend(loc="upper left", ncols=1, borderaxespad=0.2, labelspacing=0.25)
    ax.spines[["top", "right"]].set_visible(False)


QUICK: dict[str, Any] = {
    "critical": (NEAR, FAR, (0.6, 6.03, 90)),
    "caustics": (NEAR, FAR),
    "orbits": (FAR,),
    "counted": (FAR,),
    "events": (FAR,),
    "orders": 3,
    "stars": 200,
    "points": 17,
    "normals": 2000,
    "steps": 60,
    "thetas": (45.0, 85.0),
}
"""Arguments of `main` for a quick run."""


def main(
    output: Path,
    critical: tuple = CRITICAL,
    caustics: tuple = CAUSTICS,
    orbits: tuple = ORBITS,
    counted: tuple = COUNTED,
    events: tuple = EVENTS,
    orders: int = 4,
    stars: int = 2000,
    points: int = 67,
    normals: int = 20_000,
    steps: int = 360,
    thetas: tuple = (45.0, 60.0, 75.0, 85.0),
) -> list[Path]:
    """Settle the questions, write open_questions.json, .png and .md into a folder, and return their paths."""
    began = time.perf_counter()
    rng = np.random.default_rng(2015)
    curves = {name_of(place): critical_crossings(camera_of(place), orders) for place in critical}
    answers: dict[str, list[Answer]] = {}
    answers["order_1_track"], crossings = question_1(curves)
    answers["pairs"], pairs = question_2(caustics, points, rng)
    answers["original_images"], images, lifetimes = question_3(orbits, stars, thetas, rng)
    answers["counts"], circles, equatorial, kept = question_4(counted, normals, steps, rng)
    answers["velocity"], velocities = question_5(events, max(points // 3, 2), rng)
    tables = {"crossings": crossings, "pairs": pairs, "images": images, "lives": lifetimes}
    tables |= {"circles": circles, "equatorial": equatorial, "velocity": velocities}
    text = "".join(f"<!-- {name} -->\n\n{table}\n<!-- end of {name} -->\n\n" for name, table in tables.items())
    print(text)
    settings = {"orders": orders, "stars": stars, "points": points, "normals": normals, "steps": steps}
    return write_study(
        output,
        "open_questions",
        __doc__,
        draw(curves[name_of(critical[0])], kept[0], counted[0]),
        text,
        settings=settings,
        findings=findings(answers),
        answers=answers,
        seconds=time.perf_counter() - began,
    )


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.005 else "below 1 %"


def _unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
