"""Growth of caustics with spin and toward the hole, and the place where the secondary one first winds round the sky.

    kerrcaustics study spin_radius

Cameras on the equator. Extent, circuits and area of the caustics of order 1 to 4 over spin and radius come from a sweep
(spin_radius.zarr in the folder, gone on with when it is there). The radius at which the secondary caustic winds once,
and twice, round the celestial sphere is a root for each spin. Writes spin_radius.json, .png and .md.
"""

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.report.checks import CausticCheck, caustic_outcome, value_and_error
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table
from kerrcaustics.sweeps.scene import Range, Scene

from ..measured import crossing

QUESTION = "Where do caustics wind round the sky?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 156
QUICK_SECONDS = 8

SPINS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.999, 0.9999)
RADII = Range(1.5, 1000.0, 14, "log")
WINDING_SPINS = tuple(1 - gap for gap in np.geomspace(0.06, 1e-4, 12).tolist())
ORDERS, TURNS = 4, (1, 2)

# The innermost camera that is asked, in horizon radii, and the outermost.
_INNERMOST, _OUTERMOST = 1.02, 30.0
_TOLERANCE = 1e-10
# From a root to the cameras that confirm it, in units of its error.
_APART = 10.0


@dataclass(frozen=True)
class Winding:
    """The secondary caustic winds `turns` times round the sky for a camera at `radius`, known to `error`.

    confirmed: True if it is a certified astroid on both sides of this radius, and winds more inside, less outside.
    """

    spin: float
    turns: int
    radius: float
    error: float
    confirmed: bool


def secondary_circuits(spin: float, radius: float) -> tuple[float, float]:
    """Circuits of the secondary caustic and their error."""
    return value_and_error(kc.caustics(kc.Camera(spin, radius, velocity="fiducial"), orders=2)[1], "circuits")


def winding(spin: float, turns: int) -> Winding | None:
    """Radius at which the secondary caustic winds so many times; None where there is none."""
    horizon = 1 + math.sqrt(1 - spin**2)
    low, high = math.log(_INNERMOST * horizon), math.log(_OUTERMOST)
    found = crossing(lambda x: secondary_circuits(spin, math.exp(x)), turns, low, high, _TOLERANCE)
    if found is None:
        return None
    radius, error = math.exp(found.value), math.exp(found.value) * found.error
    inside = is_met(spin, radius - _APART * error, (turns, math.inf))
    return Winding(spin, turns, radius, error, inside and is_met(spin, radius + _APART * error, (0.0, turns)))


def is_met(spin: float, radius: float, circuits: tuple[float, float]) -> bool:
    """Whether the secondary caustic is an astroid whose circuits are in a range with all of their error."""
    check = CausticCheck(spin=spin, radius=radius, order=2, cusps=4, circuits=circuits)
    return caustic_outcome(check, kc.caustics(check.viewer(), orders=2)).met


def circuits_panel(ax: Axes, grid: xarray.Dataset, order: int) -> None:
    """Circuits of one order against radius, a line for each spin."""
    chosen = [spin for spin in grid.spin.values if spin > 0]
    for i, spin in enumerate(chosen):
        shade = 0.25 + 0.75 * i / max(len(chosen) - 1, 1)
        line = grid.circuits.sel(spin=spin, order=order).squeeze("inclination")
        look = {"color": style.order_colour(order), "alpha": shade, "linewidth": 1.0}
        style.draw_computed(ax, grid.radius.values, line.values, "xy", **look)
        # Lines of the primary caustic lie too close together for more.
        if i in (0, len(chosen) - 1) or (i == len(chosen) // 2 and order > 1):
            text = {"textcoords": "offset points", "va": "center", "fontsize": style.SMALLEST_TEXT}
            ax.annotate(f"a = {spin:.4g}", (grid.radius.values[-1], line.values[-1]), (5, 0), **text)
    ax.set(xscale="log", yscale="log", xlabel="radius of the camera (M)", ylabel="circuits")
    ax.axhline(1, color=style.GUIDE_COLOUR, linewidth=0.8, zorder=0)
    ax.set_title(f"{style.order_name(order)} caustic")


def winding_panel(ax: Axes, found: list[Winding]) -> None:
    """Radius against 1 - a at which the secondary caustic winds once and twice."""
    gaps = np.geomspace(0.1, 1e-4, 100)
    ax.plot(gaps, 1 + np.sqrt(1 - (1 - gaps) ** 2), color="#555555", linewidth=0.8, label="horizon")
    for turns in sorted({one.turns for one in found}):
        points = [(1 - one.spin, one.radius) for one in found if one.turns == turns]
        label = f"winds {'once' if turns == 1 else 'twice' if turns == 2 else f'{turns} times'}"
        dashes: Any = style.DASHES[(turns - 1) % len(style.DASHES)]
        style.draw_computed(ax, *np.array(points).T, "x", label=label, color=style.order_colour(2), linestyle=dashes)
    ax.set(xscale="log", xlabel="1 − a", ylabel="radius of the camera (M)")
    ax.invert_xaxis()
    ax.legend()
    ax.set_title("secondary caustic")


def picture(grid: xarray.Dataset, found: list[Winding]) -> Figure:
    """The figure of the study."""
    orders = grid.order.values.tolist()
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 5.2), layout="constrained")
        places = figure.add_gridspec(2, 3)
        for i, order in enumerate(orders):
            circuits_panel(figure.add_subplot(places[divmod(i, 3)]), grid, order)
        row, column = divmod(len(orders), 3)
        winding_panel(figure.add_subplot(places[row, column:]), found)
        figure.suptitle("cameras on the equator; the darker, the larger the spin")
    return figure


def table(found: list[Winding]) -> str:
    """The winding radii as a Markdown table."""
    heads = ["1 − a", "horizon", *(f"winds {turns} x at r =" for turns in TURNS)]
    rows = []
    for spin in dict.fromkeys(one.spin for one in found):
        radii = {one.turns: f"{one.radius:.8f}" for one in found if one.spin == spin}
        rows.append(
            [f"{1 - spin:.3g}", f"{1 + math.sqrt(1 - spin**2):.5f}", *(radii.get(turns, "") for turns in TURNS)]
        )
    return markdown_table(heads, rows)


def findings(found: list[Winding], asked: tuple[float, ...]) -> list[str]:
    """Findings, a sentence for each number of turns."""
    sentences = []
    for turns in TURNS:
        here = sorted((one for one in found if one.turns == turns), key=lambda one: one.spin)
        how = "once" if turns == 1 else "twice" if turns == 2 else f"{turns} times"
        if not here:
            sentences.append(f"The secondary caustic winds {how} round the sky for none of {len(asked)} spins.")
            continue
        first, last = here[0], here[-1]
        sentences.append(
            f"The secondary caustic winds {how} round the sky inside r = {last.radius:.4f} at a = {last.spin:.6g}; of "
            f"{len(asked)} spins, {first.spin:.6g} is the smallest at which it does so, inside r = {first.radius:.4f}."
        )
    confirmed = sum(one.confirmed for one in found)
    sentences.append(
        f"{confirmed} of {len(found)} radii are confirmed: {_APART:g} errors inside each the caustic is an astroid "
        "that winds more often, outside one that winds less."
    )
    return sentences


QUICK: dict[str, Any] = {
    "spins": (0.0, 0.3, 0.9, 0.99, 0.999),
    "radii": Range(1.5, 1000.0, 7, "log"),
    "winding_spins": (0.95, 0.99, 0.999),
}
"""Arguments of `main` for a quick run."""


def main(
    output: Path,
    spins: tuple[float, ...] = SPINS,
    radii: Range = RADII,
    winding_spins: tuple[float, ...] = WINDING_SPINS,
    orders: int = ORDERS,
) -> list[Path]:
    """Run the study; the files in `output`."""
    began = time.perf_counter()
    scene = Scene(spin=list(spins), radius=radii, velocity="fiducial", orders=orders, compute=("geometry", "areas"))
    store = output / "spin_radius.zarr"
    result = kc.sweep(scene, store)
    print(f"{result.points} cameras, {len(result.failures)} of them inside the horizon or failed")
    grid = xarray.open_zarr(store).load()
    found = [one for turns in TURNS for spin in winding_spins if (one := winding(spin, turns)) is not None]
    text = table(found)
    print(text)
    names = ("theta_extent", "phi_extent", "circuits", "caustic_area")
    values = {name: grid[name].values.tolist() for pair in names for name in (pair, f"{pair}_error")}
    entry = {
        "spin": list(spins),
        "radius": scene.values("radius").tolist(),
        "failures": list(result.failures),
        **values,
    }
    settings = {"spins": spins, "radii": entry["radius"], "winding spins": winding_spins, "orders": orders}
    files = write_study(
        output,
        "spin_radius",
        __doc__,
        picture(grid, found),
        text,
        settings=settings,
        findings=findings(found, winding_spins),
        grid=entry,
        winding=[vars(one) for one in found],
        seconds=time.perf_counter() - began,
    )
    return [*files, store]
