"""Approach to the shadow edge, drift and growth of caustics of order 1 to 10, by the exponents of the photon shell.

    kerrcaustics study orders

Caustics in double precision as far as it reaches (order 7), from the equator and off it; cusps on the equator to order
10 in long arithmetic, which trace no beam (equatorial_cusps.py). Writes orders.json, .png and .md.
"""

import math
import time
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.curves.caustic_search import HIGHEST_ORDER
from kerrcaustics.curves.critical_points import Search
from kerrcaustics.draw import style
from kerrcaustics.lens_map.lens_map import SearchMap
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.frame import photon_of, sky_from_fido
from kerrcaustics.spacetime.photon_shell import exponents, polar_growth
from kerrcaustics.spacetime.shadow import edge_photons

from .equatorial_cusps import EquatorialCusps

QUESTION = "How do caustics grow from order to order?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 22
QUICK_SECONDS = 5

SPINS = (0.1, 0.5, 0.9, 0.999)
RADIUS, INCLINATIONS, LINES = 6.03, (90.0, 45.0), 97

_TURN = 2 * math.pi
# Of the critical curves that are followed along the shadow edge; the order that double precision reaches there.
_SPIN, _REACHED = 0.999, 7
_SIDES = {"prograde": 1, "retrograde": -1}


@dataclass(frozen=True)
class Approach:
    """Steps of one camera's critical curves toward the shadow edge, on lines that leave the edge.

    turn (n,): parameter of the edge, 0 at the prograde end, pi at the retrograde one; gamma (n,): of the orbit there;
    steps (orders - 1, n): e-foldings of the distance from the edge from each curve to the next, and their errors.
    """

    inclination: float
    edge_phase: np.ndarray
    gamma: np.ndarray
    steps: np.ndarray
    errors: np.ndarray


def approach(inclination: float, orders: int, lines: int) -> Approach:
    """Approach of the critical curves of one camera to the shadow edge."""
    camera = kc.Camera(_SPIN, RADIUS, math.radians(inclination), velocity="fiducial")
    # Half of the edge; between its ends, where the orbit is an equatorial one and its limit must be taken.
    edge_phase = np.linspace(0, math.pi, lines + 2)[1:-1]
    search = Search(SearchMap(camera.at_rest()))
    low, high, _ = search.brackets(edge_phase, orders)
    depth = np.full((orders, lines), np.nan)
    for i in range(orders):
        points, found = search.refined(edge_phase, np.full(lines, i + 1), low[i], high[i])
        depth[i, found] = points.depth
    # A direction is known to 1e-16 rad; long arithmetic at the ends says that this is 2 to 100 times too large.
    error = 1e-15 * np.exp(depth) + 1e-14
    frame = camera.frame()
    b = photon_of(frame, tuple(np.moveaxis(sky_from_fido(frame, edge_photons(camera, edge_phase)), -1, 0))).b
    gamma = exponents(_SPIN, b).gamma
    return Approach(inclination, edge_phase, gamma, np.diff(depth, axis=0), error[1:] + error[:-1])


@dataclass(frozen=True)
class Ends:
    """Cusps at one end of the critical curves on the equator, order by order, and what their steps tend to.

    distance: from the shadow edge; azimuth: phi', both radians, to 1e-15; error: of phi' as `caustics` reports it, and
    true_error: against the long arithmetic, None for orders that it does not reach.
    """

    spin: float
    side: str
    gamma: float
    delta: float
    distance: list[float]
    azimuth: list[float]
    approach_excess: list[float]
    drift_excess: list[float]
    error: list[float | None]
    true_error: list[float | None]


def ends(spin: float, radius: float, orders: int, known: CausticSet) -> list[Ends]:
    """Both ends for one spin."""
    found = []
    for (side, sign), orbit in zip(_SIDES.items(), kerr.photon_orbits(spin), strict=True):
        limit = exponents(spin, kerr.spherical_orbit_impact(spin, orbit))
        gamma, delta = float(limit.gamma), float(limit.delta)
        cusps = EquatorialCusps(spin, radius, sign).cusps(orders)
        pairs = list(pairwise(cusps))
        reached: list[tuple[float, float] | tuple[None, None]] = [(None, None)] * orders
        for caustic in known:
            azimuth = float(cusps[caustic.order - 1][1]) + (_TURN * caustic.order if sign > 0 else 0)
            off = min((abs(cusp.celestial[1] - azimuth) for cusp in caustic.cusps), default=math.nan)
            reached[caustic.order - 1] = caustic.error, float(off)
        found.append(
            Ends(
                spin,
                side,
                gamma,
                delta,
                [float(distance) for distance, _ in cusps],
                [float(azimuth) for _, azimuth in cusps],
                [math.log(one[0] / next_[0]) - gamma for one, next_ in pairs],
                [float(next_[1] - one[1]) - delta for one, next_ in pairs],
                [error for error, _ in reached],
                [off for _, off in reached],
            )
        )
    return found


@dataclass(frozen=True)
class Growth:
    """Size of the caustics of one spin, order by order, and the limits of their growth from order to order.

    circuits and polar_gap (radians from the caustic to the nearer pole) with errors; circuits_limit: of the growth of
    circuits for each order; cot_limit: of that of cot(polar_gap).
    """

    spin: float
    circuits: list[float]
    polar_gap: list[float]
    errors: list[float]
    circuits_limit: float
    cot_limit: float
    missing: tuple[int, ...]


def growth(spin: float, known: CausticSet, both: list[Ends]) -> Growth:
    """Sizes of one spin's caustics."""
    gaps = [min(caustic.theta_min, math.pi - caustic.theta_max) for caustic in known]
    limit = abs(both[0].delta + _TURN - both[1].delta) / _TURN
    return Growth(
        spin,
        [caustic.circuits for caustic in known],
        gaps,
        [caustic.error for caustic in known],
        limit,
        polar_growth(spin),
        known.missing,
    )


def approach_panel(ax: Axes, found: Approach) -> None:
    """Steps toward the shadow edge along it, and gamma."""
    degrees = np.degrees(found.edge_phase)
    for i, steps in enumerate(found.steps):
        ax.plot(degrees, steps, label=f"{i + 1} to {i + 2}", **style.order_line(i + 2))
    ax.plot(degrees, found.gamma, color="black", linewidth=2.2, alpha=0.35, label="γ", zorder=0)
    ax.set(xlabel="place on the shadow edge (degrees)", ylabel="e-foldings closer", xticks=range(0, 181, 45))
    ax.set_title(f"a = {_SPIN}, camera at {found.inclination:g}°")


def ends_panel(ax: Axes, rows: list[Ends]) -> None:
    """Rate at which the steps at the ends tend to their limits."""
    for i, row in enumerate(rows):
        order = np.arange(1, len(row.drift_excess) + 1)
        colour, dashes = style.PALETTE[i // 2 % len(style.PALETTE)], "-" if row.side == "prograde" else ":"
        label = f"a = {row.spin:g}" if row.side == "prograde" else None
        ax.plot(order, np.abs(row.drift_excess), dashes, color=colour, marker="o", markersize=2.5, label=label)
    order = np.arange(4, len(rows[0].drift_excess) + 1) if len(rows[0].drift_excess) > 4 else np.array([1, 2])
    ax.plot(order, 3e1 * np.exp(-math.pi * (order - order[0])), color=style.GUIDE_COLOUR, label="exp(−π k)", zorder=0)
    ax.set(yscale="log", xlabel="order k", ylabel="drift from k to k + 1, less δ (rad)")
    ax.legend(loc="lower left", fontsize=style.SMALLEST_TEXT)
    ax.set_title("ends: prograde (line), retrograde (dots)")


def growth_panel(ax: Axes, rows: list[Growth]) -> None:
    """Growth of circuits and of cot(polar gap), over their limits."""
    for i, row in enumerate(rows):
        middle = np.arange(1, len(row.circuits)) + 0.5
        colour = style.PALETTE[i % len(style.PALETTE)]
        ax.plot(middle, np.diff(row.circuits) / row.circuits_limit, "-", color=colour, marker="o", markersize=2.5)
        cot = 1 / np.tan(row.polar_gap)
        ax.plot(middle, np.diff(cot) / row.cot_limit, "--", color=colour, marker="s", markersize=2.5)
    ax.axhline(1, color=style.GUIDE_COLOUR, linewidth=0.8, zorder=0)
    ax.set(xlabel="order", ylabel="growth per order / its limit", ylim=(0, 1.15))
    ax.set_title("circuits (line), cot of polar gap (dashes)")


def picture(curves: list[Approach], both: list[Ends], sizes: list[Growth]) -> Figure:
    """The figure of the study."""
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 5.4), layout="constrained")
        places = figure.add_gridspec(2, 2)
        panels = [figure.add_subplot(places[0, i]) for i in range(2)]
        for ax, found in zip(panels, curves, strict=False):
            approach_panel(ax, found)
        panels[0].legend(ncols=2, fontsize=style.SMALLEST_TEXT)
        if len(curves) == 1:
            panels[1].set_axis_off()
        ends_panel(figure.add_subplot(places[1, 0]), both)
        growth_panel(figure.add_subplot(places[1, 1]), sizes)
    return figure


def table(both: list[Ends], sizes: list[Growth]) -> str:
    """Limits by spin, and how close the last two orders of `caustics` come, as a Markdown table."""
    heads = [
        "spin",
        "δ prograde (turns)",
        "δ retrograde (turns)",
        "circuits / order",
        "limit",
        "cot gap / order",
        "limit",
    ]
    rows = []
    for row, size in zip(zip(both[::2], both[1::2], strict=True), sizes, strict=True):
        cot = 1 / np.tan(size.polar_gap)
        rows.append(
            [
                f"{size.spin:g}",
                *(f"{end.delta / _TURN:.6f}" for end in row),
                f"{size.circuits[-1] - size.circuits[-2]:.5f}",
                f"{size.circuits_limit:.5f}",
                f"{cot[-1] - cot[-2]:.4f}",
                f"{size.cot_limit:.4f}",
            ]
        )
    return markdown_table(heads, rows)


def findings(curves: list[Approach], both: list[Ends], sizes: list[Growth]) -> list[str]:
    """Findings, a sentence for each question."""
    ratios = [
        true / error
        for end in both
        for true, error in zip(end.true_error, end.error, strict=True)
        if true is not None and math.isfinite(true) and error
    ]
    found = [
        f"{len(ratios)} cusps on the equator agree with long arithmetic to {max(ratios, default=0):.2g} of their "
        "reported errors."
    ]
    for one in curves:
        away = np.abs(one.steps[-1] - one.gamma)
        away = away[np.isfinite(away)]
        found.append(
            f"At a = {_SPIN:g}, from {one.inclination:g} degrees, the critical curve of order {len(one.steps) + 1} is "
            f"gamma e-foldings closer than the one before, within {np.median(away):.2g} for "
            f"half of the shadow edge, {away.max():.2g} for all of it ({away.size} of {one.edge_phase.size} places)."
        )
    for size in sizes:
        grown = (size.circuits[-1] - size.circuits[-2]) / size.circuits_limit
        found.append(
            f"At a = {size.spin:g} caustics tend to grow by {size.circuits_limit:.6g} circuits an order; the last step "
            f"of {len(size.circuits)} orders is {grown:.6f} of it."
        )
    return found


QUICK: dict[str, Any] = {"spins": (0.1, 0.999), "orders": 7, "lines": 33}
"""Arguments of `main` for a quick run."""


def main(
    output: Path,
    spins: tuple[float, ...] = SPINS,
    orders: int = HIGHEST_ORDER,
    lines: int = LINES,
    inclinations: tuple[float, ...] = INCLINATIONS,
) -> list[Path]:
    """Run the study; the files in `output`."""
    if not 2 <= orders <= HIGHEST_ORDER:
        raise ValueError(f"Argument `orders` must be from 2 to {HIGHEST_ORDER}, but is {orders}.")
    began = time.perf_counter()
    curves = [approach(inclination, min(orders, _REACHED), lines) for inclination in inclinations]
    both, sizes = [], []
    for spin in spins:
        known = kc.caustics(kc.Camera(spin, RADIUS, velocity="fiducial"), orders=orders)
        pair = ends(spin, RADIUS, orders, known)
        both += pair
        sizes.append(growth(spin, known, pair))
    text = table(both, sizes)
    print(text)
    return write_study(
        output,
        "orders",
        __doc__,
        picture(curves, both, sizes),
        text,
        settings={
            "spins": spins,
            "spin of the critical curves": _SPIN,
            "radius": RADIUS,
            "orders": orders,
            "inclinations": inclinations,
            "lines": lines,
        },
        findings=findings(curves, both, sizes),
        approach=[{"spin": _SPIN, **asdict(one)} for one in curves],
        ends=[asdict(one) for one in both],
        growth=[asdict(one) for one in sizes],
        seconds=time.perf_counter() - began,
    )
