"""Check disks against theory, other programs and slower sums: each check with its number and its bound.

    kerrcaustics study disk_checks

Rays: where they meet the plane, when, with what frequency, how magnified. Light: its laws, its profile, its energy.
What the numbers are held against shares no code with the package: closed forms, quadratures, other programs' numbers
(others.json), and a twin that traces rays from infinity by quadrature and Runge-Kutta steps (twin.py). Line profiles
are timed against a histogram of rays, settings taking turns.

The picture: isoradials of a hole that does not spin, in closed form (lines) and traced (dots); line profiles, with the
twin's as dots; error against time of two profiles, with reported errors as open circles.

Writes disk_checks.json, disk_checks.png and disk_checks.md.
"""

import math
import time
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

import kerrcaustics as kc
from kerrcaustics.draw.style import PAGE_WIDTH, PALETTE, RC
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table, text_table
from kerrcaustics.scenes.disk.ring_images import ring_images

from . import light, rays, schwarzschild, twin, work
from .verdict import Check

QUESTION = "Do disks show what theory and others say?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 88
QUICK_SECONDS = 20

NODES = ((8, 32), (8, 64), (16, 64), (16, 128), (32, 128), (32, 256))
SIDES = (64, 90, 128, 181, 256, 362, 512)
FINEST = (64, 768)
RINGS = ((0.0, 80.0), (0.9, 60.0))


def checks(rings: tuple[tuple[float, float], ...], turns: int) -> tuple[list[Check], list[dict[str, float]]]:
    """All of them, and the means of the transfer function."""
    mean, means = light.transfer_checks()
    found = [
        rays.landings(),
        rays.times(),
        rays.long_ray(),
        *rays.closed_isoradials(turns=min(turns, 90)),
        rays.face_on(),
        rays.edge_on(),
        rays.spot(),
        light.iscos(),
        light.peaks(),
        light.flux(),
        light.efficiency(),
        *(light.ring(spin, inclination, turns=turns) for spin, inclination in rings),
        light.line_edges(),
        mean,
        *light.transfer_points(),
        light.uniform(),
    ]
    return found, means


def isoradial_panel(ax: Axes, turns: int = 48) -> None:
    """Isoradials of spin 0, images 1 and 2, at 80 degrees."""
    camera = kc.Camera(0.0, 1e4, math.radians(80), "static")
    fine, coarse = np.linspace(0, 2 * math.pi, 361), np.arange(turns) * 2 * math.pi / turns
    for crossing in (1, 2):
        colour = PALETTE[crossing - 1]
        for radius in (6.0, 10.0, 20.0):
            line = schwarzschild.isoradial(radius, camera.inclination, fine, crossing)
            label = f"image {crossing}" if radius == 6 else None
            ax.plot(line * np.cos(fine), line * np.sin(fine), color=colour, linewidth=0.8, label=label)
            found = ring_images(camera, np.full(turns, radius), coarse, crossing, "circular").sky
            ax.plot(*(camera.radius * found[:, 1:].T), ".", color=colour, markersize=2.5)
    ax.set(xlabel="α (M)", ylabel="β (M)", xlim=(-23, 23))
    # As high as the panel beside it.
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_title("isoradials 6, 10, 20 at a = 0, 80°")
    ax.legend(loc="lower right")


def profile_panel(ax: Axes, turns: int) -> None:
    """Line profiles: a ring with the twin's, and two disks."""
    observer = kc.Observer(spin=0.9, inclination=math.radians(60))
    ring = kc.line_profile(observer, 6.0, 6.06, bins=40, turns=2 * turns)
    slow = twin.ring_profile(twin.Screen(0.9, observer.inclination), 6.0, 6.06, 3.0, ring.edges, turns)
    lines = [("ring at 6, a = 0.9", ring), ("r⁻³, a = 0.6", light.line())]
    case = work.cases()[1]
    lines.append(("Page & Thorne, a = 0.9", case.profile(16, 256)))
    for k, (name, found) in enumerate(lines):
        density = found.flux / np.diff(found.edges)
        ax.stairs(density / density.max(), found.edges, color=PALETTE[k], label=name)
        if k == 0:
            dots = slow / np.diff(found.edges) / density.max()
            ax.plot((found.edges[1:] + found.edges[:-1]) / 2, dots, ".", color=PALETTE[k], markersize=3)
    ax.set(xlabel="g", ylabel="light per g, over its largest", xlim=(0.2, 1.3), ylim=(0, 1.15))
    ax.set_title("line profiles, 60°")
    ax.legend(loc="upper left")


def work_panel(ax: Axes, found: list[work.Work]) -> None:
    """Error against time of both methods."""
    for k, method in enumerate(work.METHODS):
        here = [one for one in found if one.method == method]
        seconds, errors = [one.seconds for one in here], [one.error for one in here]
        ax.plot(seconds, errors, marker="o", markersize=3, color=PALETTE[k], label=method)
        reported, name = [one.reported for one in here], None if k else "its reported error"
        ax.plot(seconds, reported, "o", color=PALETTE[k], markersize=3, fillstyle="none", label=name)
    ax.set(xscale="log", yscale="log", xlabel="time (s)", ylabel="error of the worst bin / peak")
    ax.set(xlim=(0.01, 2), ylim=(1e-6, 2))
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_title(found[0].case)
    ax.legend(loc="lower left")


def picture(worked: list[list[work.Work]], turns: int) -> Figure:
    """The figure of the study."""
    with rc_context(RC):
        figure = Figure(figsize=(PAGE_WIDTH, 5.6), layout="constrained")
        axes = figure.subplots(2, 2, height_ratios=(0.8, 1))
        isoradial_panel(axes[0, 0])
        profile_panel(axes[0, 1], turns)
        for ax, found in zip(axes[1], worked, strict=True):
            work_panel(ax, found)
            ax.spines[["top", "right"]].set_visible(False)
    return figure


def tables(found: list[Check], means: list[dict[str, float]]) -> list[tuple[str, list, list]]:
    """Caption, heads and rows of each table."""
    rows = [
        [one.name, one.against, f"{one.miss:.1e} {one.unit}".strip(), f"{one.bound:.0e}{_doubt(one)}"] for one in found
    ]
    given = light.OTHERS["disk"]["transfer_function_mean"]
    of_f = [
        [f"{angle}°", *(f"{one:.5f}" for one in mean.values()), f"{theirs:.5f}"]
        for angle, mean, theirs in zip(given["inclination_deg"], means, given["f_over_angle"], strict=True)
    ]
    return [
        ("checks", ["check", "against", "off by", "bound"], rows),
        ("means of the transfer function", ["inclination", *means[0], "Gradus, 2022"], of_f),
    ]


def _doubt(check: Check) -> str:
    """What follows the bound of a check that fails."""
    return "" if check.verdict == "holds" else ", not met"


def findings(found: list[Check], worked: list[work.Work]) -> list[str]:
    """Findings, in sentences."""
    failed = [one.name for one in found if one.verdict == "fails"]
    total = f"{len(found) - len(failed)} of {len(found)} checks hold"
    sentences = [f"{total}." if not failed else f"{total}; these do not: {'; '.join(failed)}."]
    for name in dict.fromkeys(one.case for one in worked):
        best = [
            min((o for o in worked if (o.case, o.method) == (name, m)), key=lambda o: o.error) for m in work.METHODS
        ]
        costs = [f"{one.error:.0e} of its peak in {one.seconds:.2f} s from {one.method}" for one in best]
        sentences.append(f"The profile of {name}: {', '.join(costs)}.")
    return sentences


QUICK: dict[str, Any] = {
    "rings": ((0.9, 60.0),),
    "turns": 120,
    "nodes": ((8, 32), (16, 64)),
    "sides": (32, 64),
    "finest": (32, 256),
    "rounds": 1,
}
"""Arguments of `main` for a quick run."""


def main(
    output: Path,
    rings: tuple[tuple[float, float], ...] = RINGS,
    turns: int = 240,
    nodes: tuple[tuple[int, int], ...] = NODES,
    sides: tuple[int, ...] = SIDES,
    finest: tuple[int, int] = FINEST,
    rounds: int = 5,
) -> list[Path]:
    """Run the study; the files in `output`."""
    began = time.perf_counter()
    found, means = checks(rings, turns)
    worked = [work.measured(case, nodes, sides, finest, rounds) for case in work.cases()]
    flat = [one for part in worked for one in part]
    made = tables(found, means)
    for _, heads, rows in made:
        print(text_table(heads, rows))
    text = "\n".join(f"<!-- {name} -->\n\n{markdown_table(*rest)}\n<!-- end of {name} -->\n" for name, *rest in made)
    settings = {"rings": rings, "turns": turns, "nodes": nodes, "sides": sides, "finest": finest, "rounds": rounds}
    return write_study(
        output,
        "disk_checks",
        __doc__,
        picture(worked, turns),
        text,
        settings=settings,
        findings=findings(found, flat),
        checks=[vars(one) | {"verdict": one.verdict} for one in found],
        transfer_means=means,
        work=[vars(one) for one in flat],
        seconds=time.perf_counter() - began,
    )
