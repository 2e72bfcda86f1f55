"""Changes of caustics as the camera moves from the equator to the spin axis.

    kerrcaustics study inclination

Extent, circuits, area and cusps of the caustics of order 1 to 4 over spin, radius and inclination come from a sweep
(inclination.zarr in the folder, gone on with when it is there). The powers of sin(inclination) close to the axis are
limits, as measured.py says; the inclinations at which a caustic winds once round the sky are roots. Writes
inclination.json, .png and .md.
"""

import math
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import kerrcaustics as kc
from kerrcaustics.beams.trace import cores
from kerrcaustics.draw import style
from kerrcaustics.report.checks import value_and_error
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table
from kerrcaustics.sweeps.scene import Scene

from ..measured import Measured, crossing, series

QUESTION = "How do caustics change from equator to axis?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 130
QUICK_SECONDS = 14

SPINS = (0.3, 0.9, 0.999)
RADII = (2.6, 6.03, 1000.0)
INCLINATIONS = (0.0, 5.0, 10.0, 12.0, 17.0, 20.0, 25.0, 35.0, 42.5, 50.0, 60.0, 70.0, 75.0, 80.0, 85.0, 90.0)
# Each twice the one before: the steps of the local powers.
NEAR_SINES = tuple(0.5 ** (9 - k) for k in range(9))
ORDERS = 4

_POWERS = {"theta_extent": 2, "phi_extent": 1, "caustic_area": 4}
# Degrees: the least inclination at which a winding is looked for; the error of a root.
_LEAST, _ROOT_ERROR = 5.0, 1e-9
_DASHES = ("-", (0, (4, 1.5)), (0, (1.2, 1.2)))


@dataclass(frozen=True)
class NearAxis:
    """A quantity of one caustic goes as coefficient x sin(inclination)^power close to the axis.

    coefficient: for the power that is the nearest whole number, in degrees or, of an area, steradians.
    """

    spin: float
    radius: float
    order: int
    quantity: str
    power: Measured
    coefficient: Measured


@dataclass(frozen=True)
class Winding:
    """The caustic of an order winds once round the sky at an inclination in degrees, and not closer to the axis."""

    spin: float
    radius: float
    order: int
    inclination: float
    error: float


def near_axis(grid: xarray.Dataset, quantity: str, sines: np.ndarray) -> NearAxis:
    """The law of one quantity of one caustic from its values at the given sines, each twice the one before."""
    near = grid.sel(inclination=np.degrees(np.arcsin(sines)), method="nearest")
    values, errors = near[quantity].values, _near_errors(near, quantity, sines)
    relative = errors / values
    local = np.log2(values[1:] / values[:-1])
    local_error = np.hypot(relative[1:], relative[:-1]) / math.log(2)
    power, x = _POWERS[quantity], sines**2

    def limit(x: np.ndarray, y: np.ndarray, error: np.ndarray) -> Measured:
        # Far from the axis there may be no series, and close to it values are less exact.
        few = min(4, len(x))
        runs = [slice(m, n) for n in range(few, len(x) + 1) for m in range(n - few + 1)]
        return min((series(x[run], y[run], error[run])[0] for run in runs), key=lambda found: found.error)

    return NearAxis(
        spin=float(grid.spin),
        radius=float(grid.radius),
        order=int(grid.order),
        quantity=quantity,
        power=limit(x[:-1], local, local_error),
        coefficient=limit(x, values / sines**power, errors / sines**power),
    )


def _near_errors(near: xarray.Dataset, quantity: str, sines: np.ndarray) -> np.ndarray:
    """Errors beside the axis: a caustic reports that of phi', and theta' is more certain by sin(inclination)."""
    if quantity == "phi_extent":
        return near.phi_extent_error.values
    if quantity == "theta_extent":
        return near.theta_extent_error.values * sines
    error = np.radians(near.phi_min_error.values)
    theta, phi = (np.radians(near[f"{name}_extent"].values) for name in ("theta", "phi"))
    # Of the area's error, what comes from the points is 2 error (theta + phi), to be scaled; the rest is kept.
    rest = near.caustic_area_error.values - 2 * error * (theta + phi) - error**2
    return np.maximum(rest, 0) + 2 * error * sines * (theta + phi * sines) + (error * sines) ** 2


def circuits(spin: float, radius: float, order: int, inclination: float) -> tuple[float, float]:
    """Circuits of the caustic of an order, and their error."""
    camera = kc.Camera(spin, radius, math.radians(inclination), velocity="fiducial")
    caustic = next(one for one in kc.caustics(camera, orders=order) if one.order == order)
    return value_and_error(caustic, "circuits")


def winding(spin: float, radius: float, order: int) -> Winding | None:
    """Inclination at which a caustic winds once round the sky; None where it does not on the equator."""
    found = crossing(lambda angle: circuits(spin, radius, order, angle), 1, _LEAST, 90.0, _ROOT_ERROR)
    return found and Winding(spin, radius, order, found.value, found.error)


def pole_distance(grid: xarray.Dataset) -> tuple[float, float]:
    """Least distance of any caustic from a pole of the sky, as a part of the inclination; and the latter in degrees."""
    away = grid.where(grid.inclination > 0)
    distance = np.minimum(away.theta_min, 180 - away.theta_max) / away.inclination
    place = distance.argmin(...)
    return float(distance.min()), float(grid.inclination[place["inclination"]])


def lines_panel(ax: Axes, grid: xarray.Dataset, values: xarray.DataArray, sines: bool) -> None:
    """A quantity of the fastest hole against inclination or its sine: colour says the order, dashes the radius."""
    x = np.sin(np.radians(grid.inclination)) if sines else grid.inclination
    for order in grid.order.values.tolist():
        for radius, dashes in zip(grid.radius.values, _DASHES, strict=False):
            line = values.sel(order=order, radius=radius, spin=grid.spin.max())
            scales = "xy" if sines else ""
            look = {"color": style.order_colour(order), "linestyle": dashes, "linewidth": 0.9}
            style.draw_computed(ax, x.values, line.values, scales, **look)
    if sines:
        ax.set(xscale="log", yscale="log", xlim=(x.min(), 1), xlabel="sin i")
    else:
        ax.set(xlim=(0, 90), xticks=range(0, 91, 15), xlabel="inclination i (degrees)")


def picture(grid: xarray.Dataset) -> Figure:
    """The figure of the study."""
    away = grid.sel(inclination=grid.inclination > 0)
    shape = away.theta_extent / np.sin(np.radians(away.inclination)) ** 2
    panels = [
        (away.theta_extent, "width in θ′ (degrees)", True),
        (away.caustic_area, "area (steradian)", True),
        (shape / shape.sel(inclination=90.0), "width in θ′ / sin² i, 1 at the equator", False),
        (away.circuits, "circuits", False),
    ]
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 5.6), layout="constrained")
        axes = figure.subplots(2, 2)
        for ax, (values, label, sines) in zip(axes.flat, panels, strict=True):
            lines_panel(ax, away, values, sines)
            ax.set_ylabel(label)
        circuits_ax = axes[1, 1]
        circuits_ax.set(yscale="log", ylim=(1e-3, 2 * float(away.circuits.max())))
        circuits_ax.axhline(1, color=style.GUIDE_COLOUR, linewidth=0.8, zorder=0)
        orders = [(style.order_colour(k), "-", style.order_name(k)) for k in grid.order.values.tolist()]
        radii = [("#555555", dashes, f"r = {r:g}") for r, dashes in zip(grid.radius.values, _DASHES, strict=False)]
        handles = [Line2D([], [], color=c, linestyle=dashes, label=word) for c, dashes, word in orders + radii]
        figure.legend(
            handles=handles, loc="outside lower center", ncols=len(handles), columnspacing=1.2, handlelength=1.6
        )
        figure.suptitle(f"a = {float(grid.spin.max()):g}, from the axis to the equator")
    return figure


def table(grid: xarray.Dataset, laws: list[NearAxis], found: list[Winding]) -> str:
    """Law near the axis, size at the equator, where each caustic winds once; of the slowest and the fastest hole."""
    heads = [
        "caustic",
        "width / sin² i near the axis",
        "width at the equator",
        "circuits there",
        "1 at i =",
    ]
    known = {(one.spin, one.radius, one.order): one for one in found}
    rows = []
    for law in laws:
        if law.quantity != "theta_extent" or law.spin not in (grid.spin.min(), grid.spin.max()):
            continue
        place = (law.spin, law.radius, law.order)
        there = grid.sel(spin=law.spin, radius=law.radius, order=law.order, inclination=90.0)
        root = known.get(place)
        rows.append(
            [
                f"a = {law.spin:g}, r = {law.radius:g}, order {law.order}",
                str(law.coefficient),
                f"{float(there.theta_extent):.6g}",
                f"{float(there.circuits):.4g}",
                "" if root is None else str(Measured(root.inclination, root.error)),
            ]
        )
    return markdown_table(heads, rows)


def summary(grid: xarray.Dataset, laws: list[NearAxis]) -> dict[str, Any]:
    """Properties of all caustics together."""
    on_axis, away = grid.sel(inclination=0.0), grid.sel(inclination=grid.inclination > 0)
    reported = away.cusp_count.values > 0
    part, where = pole_distance(grid)
    return {
        "largest_extent_on_axis": float(on_axis.theta_extent.max()),
        "largest_extent_on_axis_in_errors": float((on_axis.theta_extent / on_axis.theta_extent_error).max()),
        "caustics_off_axis": int(reported.size),
        "with_cusps": int(reported.sum()),
        "cusp_counts": sorted(set(away.cusp_count.values[reported].tolist())),
        "all_closed": bool((away.closed == 1).all()),
        "least_pole_distance": part,
        "its_inclination": where,
        "powers": {name: _misses([one for one in laws if one.quantity == name], _POWERS[name]) for name in _POWERS},
    }


def _misses(laws: list[NearAxis], power: int) -> dict[str, float]:
    """Largest distance of the measured powers from a whole number, also in their errors, and the largest error."""
    miss = [abs(one.power.value - power) for one in laws]
    error = [one.power.error for one in laws]
    in_errors = max(m / e for m, e in zip(miss, error, strict=True))
    return {"largest_miss": max(miss), "largest_miss_in_errors": in_errors, "largest_error": max(error)}


def findings(whole: dict[str, Any], found: list[Winding]) -> list[str]:
    """Findings, a sentence for each question."""
    powers = ", ".join(
        f"{_POWERS[name]} for {name.replace('_', ' ')} (to {row['largest_miss']:.1g}, error {row['largest_error']:.1g})"
        for name, row in whole["powers"].items()
    )
    counts = " or ".join(map(str, whole["cusp_counts"]))
    sentences = [
        f"Caustics on the axis are points, at most {whole['largest_extent_on_axis_in_errors']:.2g} errors wide.",
        f"Close to the axis they go as powers of sin i: {powers}.",
        f"{whole['with_cusps']} of {whole['caustics_off_axis']} caustics off the axis are large enough to count their "
        f"cusps: {f'all have {counts}' if counts else 'none'}.",
        f"None comes closer to a pole of the sky than {whole['least_pole_distance']:.2g} of the camera's inclination.",
    ]
    sentences += [
        f"At a = {one.spin:g} and r = {one.radius:g}, the caustic of order {one.order} winds round the sky at an "
        f"inclination above {Measured(one.inclination, one.error)} degrees."
        for one in found
        if one.order == 2
    ]
    return sentences


QUICK: dict[str, Any] = {
    "spins": (0.999,),
    "radii": (2.6, 6.03),
    "inclinations": (0.0, 20.0, 45.0, 70.0, 90.0),
    "near_sines": (0.015625, 0.03125, 0.0625, 0.125, 0.25, 0.5),
    "orders": 3,
}
"""Arguments of `main` for a quick run."""


def main(
    output: Path,
    spins: tuple[float, ...] = SPINS,
    radii: tuple[float, ...] = RADII,
    inclinations: tuple[float, ...] = INCLINATIONS,
    near_sines: tuple[float, ...] = NEAR_SINES,
    orders: int = ORDERS,
) -> list[Path]:
    """Run the study; the files in `output`."""
    if not {0.0, 90.0} <= set(inclinations):
        raise ValueError(f"Argument `inclinations` must hold 0 and 90, but is {inclinations}.")
    began = time.perf_counter()
    sines = np.array(near_sines)
    angles = sorted({*inclinations, *np.degrees(np.arcsin(sines)).tolist()})
    scene = Scene(list(spins), list(radii), angles, "fiducial", orders, ("geometry", "areas"), block=len(radii))
    store = output / "inclination.zarr"
    kc.sweep(scene, store)
    grid = xarray.open_zarr(store).load()
    places = [(spin, radius, order) for spin in spins for radius in radii for order in range(1, orders + 1)]
    laws = [
        near_axis(grid.sel(spin=spin, radius=radius, order=order), name, sines)
        for spin, radius, order in places
        for name in _POWERS
    ]
    # On the equator the sweep knows which caustics wind at all.
    widest = grid.circuits.sel(inclination=90.0)
    winds = [p for p in places if float(widest.sel(spin=p[0], radius=p[1], order=p[2])) > 1]
    with ThreadPoolExecutor(cores()) as pool:
        found = [one for one in pool.map(lambda place: winding(*place), winds) if one is not None]
    text = table(grid, laws, found)
    print(text)
    whole = summary(grid, laws)
    print("\n".join(f"{name}: {value}" for name, value in whole.items()))
    names = ("theta_min", "theta_max", "theta_extent", "phi_extent", "circuits", "caustic_area")
    values = {name: grid[name].values.tolist() for pair in names for name in (pair, f"{pair}_error")}
    entry = {"spin": list(spins), "radius": list(radii), "inclination": angles, **values}
    files = write_study(
        output,
        "inclination",
        __doc__,
        picture(grid),
        text,
        settings={"spins": spins, "radii": radii, "inclinations": len(angles), "orders": orders},
        findings=findings(whole, found),
        summary=whole,
        grid=entry,
        near_axis=[asdict(one) for one in laws],
        winding=[asdict(one) for one in found],
        seconds=time.perf_counter() - began,
    )
    return [*files, store]
