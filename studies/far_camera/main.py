"""Limits of the caustics of a camera as it goes far away: values, with errors, against theory.

    kerrcaustics study far_camera

Sizes and places of the caustics of order 1 to 4 over spin and radius come from two sweeps (far_camera.zarr and
far_camera_inclined.zarr in the folder, gone on with when they are there), the caustic tube of a far observer close to
the hole from tube.py. Every limit is the first coefficient of a power series through them, as measured.py
says. Writes far_camera.json, .png and .md.
"""

import math
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from scipy.optimize import brentq

import kerrcaustics as kc
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table
from kerrcaustics.sweeps.scene import Range, Scene

from ..measured import Measured, difference, series
from .picture import picture
from .tube import Section, section

QUESTION = "What do caustics tend to for far cameras?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 81
QUICK_SECONDS = 16

SPINS = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 0.9, 0.95, 0.98, 0.999)
RADII = Range(20.0, 2000.0, 14, "log")
INCLINED = ((0.3, 0.999), (30.0, 60.0))
TUBES = ((0.6, 90.0), (0.999, 90.0), (0.999, 60.0), (0.999, 30.0))
TUBE_RADII = tuple(np.geomspace(15.0, 200.0, 12).tolist())
ORDERS = 4

WIDTH, SHIFT, DRIFT = 15 * math.pi / 128, 5 * math.pi / 32, 2 * math.pi / (3 * math.sqrt(3))
"""Full width of the primary caustic in a^2 / r^2, second term of its displacement, drift of an order: the theory."""

RAUCH_BLANDFORD = 0.34
# In 1/sqrt(r), the widths of the primary caustic and of its tube have no first term: the study measures that, too.
_WITHOUT_FIRST = (0, *range(2, 12))
# The largest spin that counts in limits of small spin.
_SMALL_SPIN = 0.4
# Of such spins, for a series with an error.
_FEWEST = 4


@dataclass(frozen=True)
class Primary:
    """The primary caustic far away, for one spin and inclination (degrees).

    phi, theta: full widths, times (r / (a sin i))^2, theta' as it is and phi' times sin i: limit, coefficients of 1/r
    and of 1/r^(3/2). phi_first, theta_first: the coefficient of 1/sqrt(r), elsewhere taken to be 0. shift: limit, and
    coefficients of 1/sqrt(r) and of 1/r, of (pi - phi') r / a of the middle of the caustic.
    """

    spin: float
    inclination: float
    phi: tuple[Measured, ...]
    theta: tuple[Measured, ...]
    phi_first: Measured
    theta_first: Measured
    shift: tuple[Measured, ...]


@dataclass(frozen=True)
class Higher:
    """A caustic of higher order for a camera at infinite radius, equatorial.

    phi, theta: full widths / a^2; lag: (order pi - phi') / a of the middle; lag_first: coefficient of its 1/r.
    """

    spin: float
    order: int
    phi: Measured
    theta: Measured
    lag: Measured
    lag_first: Measured


@dataclass(frozen=True)
class Slow:
    """The same for spin going to 0; drift: lag more than the order before, whose limit is 0 for the primary one."""

    order: int
    phi: Measured
    theta: Measured
    drift: Measured


@dataclass(frozen=True)
class Tube:
    """Limits of a tube's sections, far behind the hole, and its first term when that is not taken to be 0."""

    spin: float
    inclination: float
    across: Measured
    along: Measured
    across_first: Measured
    along_first: Measured


def primary(grid: xarray.Dataset, spin: float, inclination: float) -> Primary:
    """Limits of the primary caustic of one spin and inclination."""
    row = grid.sel(spin=spin, inclination=inclination, order=1)
    radius, sine = grid.radius.values, math.sin(math.radians(inclination))
    x = radius**-0.5
    parts = []
    for name, part in (("phi", sine), ("theta", 1.0)):
        scale = np.radians(part) * (radius / (spin * sine)) ** 2
        y, error = row[f"{name}_extent"].values * scale, row[f"{name}_extent_error"].values * scale
        parts += [series(x, y, error, 3, _WITHOUT_FIRST), series(x, y, error, 2)[1]]
    shift = series(x, *_lag(row, 1, radius / spin), 3)
    return Primary(spin, inclination, parts[0], parts[2], parts[1], parts[3], shift)


def higher(grid: xarray.Dataset, spin: float, order: int) -> Higher:
    """Limits of a caustic of order 2 or more, of a camera on the equator."""
    row = grid.sel(spin=spin, inclination=90.0, order=order)
    x, scale = 1 / grid.radius.values, math.radians(1) / spin**2
    widths = [
        series(x, row[f"{name}_extent"].values * scale, row[f"{name}_extent_error"].values * scale)[0]
        for name in ("phi", "theta")
    ]
    return Higher(spin, order, *widths, *series(x, *_lag(row, order, 1 / spin), 2))


def _lag(row: xarray.Dataset, order: int, scale: Any) -> tuple[np.ndarray, np.ndarray]:
    """Distance of the middle of a caustic before phi' = order pi, and its error, times a scale."""
    middle = np.radians((row.phi_min + row.phi_max).values / 2)
    return (order * math.pi - middle) * scale, np.radians(row.phi_min_error.values) * scale


def slow(found: list[Higher]) -> list[Slow]:
    """Limits of small spin, from those of far cameras: in all of them the next term goes as the spin squared."""
    limits, before = [], Measured(0.0, 0.0)
    for order in sorted({one.order for one in found}):
        rows = [one for one in found if one.order == order and one.spin <= _SMALL_SPIN]
        x = np.array([one.spin for one in rows]) ** 2
        phi, theta, lag = (
            series(x, np.array([m.value for m in column]), np.array([m.error for m in column]))[0]
            for column in ([one.phi for one in rows], [one.theta for one in rows], [one.lag for one in rows])
        )
        limits.append(Slow(order, phi, theta, difference(lag, before)))
        before = lag
    return limits


def first_terms(primaries: list[Primary]) -> dict[str, tuple[Measured, ...]]:
    """The 1/r term of the widths of equatorial cameras: its limit for spin going to 0, and the coefficient of a^2."""
    rows = [one for one in primaries if one.inclination == 90]
    x = np.array([one.spin for one in rows]) ** 2
    columns = {"phi": [one.phi[1] for one in rows], "theta": [one.theta[1] for one in rows]}
    return {
        name: series(x, np.array([m.value for m in column]), np.array([m.error for m in column]), 2)
        for name, column in columns.items()
    }


def tube(sections: list[Section]) -> Tube:
    """Limits of the sections of one tube."""
    x = np.array([one.radius for one in sections]) ** -0.5
    columns = [[one.across for one in sections], [one.along for one in sections]]
    data = [(np.array([m.value for m in column]), np.array([m.error for m in column])) for column in columns]
    limits = [series(x, *column, 1, _WITHOUT_FIRST)[0] for column in data]
    return Tube(sections[0].spin, sections[0].inclination, *limits, *(series(x, *column, 2)[1] for column in data))


def radius_of_width(spin: float, width: float) -> float:
    """Radius at which the primary caustic of an equatorial camera is as wide in phi' as `width` a^2 / r^2."""

    def excess(radius: float) -> float:
        found = kc.caustics(kc.Camera(spin, radius, velocity="fiducial"), orders=1)[0]
        return found.phi_extent * (radius / spin) ** 2 - width

    return float(brentq(excess, 15.0, 100.0, xtol=1e-6))


def table(primaries: list[Primary], slows: list[Slow], tubes: list[Tube]) -> str:
    """The limits as Markdown tables."""
    heads = [
        "primary caustic",
        "width in φ′",
        "its 1/r term",
        "width in θ′",
        "its 1/r term",
    ]
    rows = [[f"a = {one.spin:g}, {one.inclination:g}°", *map(str, (*one.phi[:2], *one.theta[:2]))] for one in primaries]
    rows.append(["theory", f"{WIDTH:.8f}", "", f"{WIDTH:.8f}", ""])
    first = markdown_table(heads, rows)
    heads = ["small spin", "width in φ′ / a²", "width in θ′ / a²", "drift / a"]
    rows = [[f"order {one.order}", str(one.phi), str(one.theta), str(one.drift)] for one in slows]
    second = markdown_table(heads, [*rows, ["theory, high order", "", "", f"{DRIFT:.6f}"]])
    heads = ["tube of a far observer", "across", "along"]
    rows = [[f"a = {one.spin:g}, {one.inclination:g}°", str(one.across), str(one.along)] for one in tubes]
    third = markdown_table(heads, [*rows, ["theory", f"{WIDTH:.6f}", f"{WIDTH:.6f}"]])
    return "\n".join([first, second, third])


def findings(primaries: list[Primary], slows: list[Slow], tubes: list[Tube]) -> list[str]:
    """Findings, a sentence for each question."""
    widths = [width for one in primaries for width in (one.phi[0], one.theta[0])]
    best = min(widths, key=lambda width: width.error)
    off = max(abs(width.value - WIDTH) / width.error for width in widths)
    shift = min((one.shift for one in primaries), key=lambda shift: shift[0].error)
    ends = [width for one in tubes for width in (one.across, one.along)]
    sentences = [
        f"Far away the primary caustic is {best} a^2 sin^2 i / r^2 wide and high (the best of {len(widths)} limits, "
        f"all within {off:.2g} errors of 15 pi / 128 = {WIDTH:.8f}).",
        f"Its middle lies before phi' = pi by a / r times {shift[0]} + {shift[1]} / sqrt(r) + ... "
        f"(5 pi / 32 = {SHIFT:.6f}).",
    ]
    sentences += [
        f"For small spin order {one.order} tends to {one.phi} a^2 in phi' and {one.theta} a^2 in theta', and lies "
        f"{one.drift} a behind the order before (high orders: {DRIFT:.6f} a)."
        for one in slows
    ]
    if ends:
        width = min(ends, key=lambda width: width.error)
        off = abs(width.value - RAUCH_BLANDFORD) / width.error
        sentences.append(
            f"The tube of a far observer tends to {width} a^2 sin^2 i / r, {off:.2g} errors from {RAUCH_BLANDFORD:g}."
        )
    return sentences


QUICK: dict[str, Any] = {
    "spins": (0.1, 0.2, 0.3, 0.4, 0.999),
    "radii": Range(20.0, 2000.0, 10, "log"),
    "inclined": ((0.999,), (60.0,)),
    "tubes": ((0.999, 60.0),),
    "tube_radii": tuple(np.geomspace(15.0, 200.0, 8).tolist()),
    "orders": 2,
}
"""Arguments of `main` for a quick run."""


def main(
    output: Path,
    spins: tuple[float, ...] = SPINS,
    radii: Range = RADII,
    inclined: tuple[tuple[float, ...], tuple[float, ...]] = INCLINED,
    tubes: tuple[tuple[float, float], ...] = TUBES,
    tube_radii: tuple[float, ...] = TUBE_RADII,
    orders: int = ORDERS,
) -> list[Path]:
    """Run the study; the files in `output`."""
    if sum(spin <= _SMALL_SPIN for spin in spins) < _FEWEST:
        raise ValueError(f"Argument `spins` must hold {_FEWEST} or more up to {_SMALL_SPIN}, but is {spins}.")
    began = time.perf_counter()
    grids, stores = [], []
    for name, some, inclinations, most in (("", spins, (90.0,), orders), ("_inclined", *inclined, 1)):
        scene = Scene(list(some), radii, list(inclinations), "fiducial", most, ("geometry",))
        stores.append(output / f"far_camera{name}.zarr")
        kc.sweep(scene, stores[-1])
        grids.append(xarray.open_zarr(stores[-1]).load())
    primaries = [primary(grids[0], spin, 90.0) for spin in spins]
    primaries += [primary(grids[1], spin, inclination) for spin in inclined[0] for inclination in inclined[1]]
    highers = [higher(grids[0], spin, order) for order in range(2, orders + 1) for spin in spins]
    slows = slow(highers)
    sections = [[section(spin, inclination, radius) for radius in tube_radii] for spin, inclination in tubes]
    ends = [tube(cuts) for cuts in sections]
    terms = first_terms(primaries)
    text = table(primaries, slows, ends)
    print(text)
    for name, term in terms.items():
        print(f"1/r term of the width in {name}': {term[0]} + {term[1]} a^2")
    found = {"primary": primaries, "higher": highers, "slow": slows, "tube": ends}
    entry: dict[str, Any] = {name: [asdict(one) for one in rows] for name, rows in found.items()}
    entry["section"] = [asdict(cut) for cuts in sections for cut in cuts]
    entry["first_terms"] = {name: [asdict(m) for m in term] for name, term in terms.items()}
    entry["theory"] = {"width": WIDTH, "shift": SHIFT, "drift": DRIFT}
    entry["radius_of_width"] = [
        {"spin": spin, "width": RAUCH_BLANDFORD, "radius": radius_of_width(spin, RAUCH_BLANDFORD)}
        for spin in (min(spins), max(spins))
    ]
    for row in entry["radius_of_width"]:
        print(f"a = {row['spin']:g}: width {row['width']:g} a^2 / r^2 at r = {row['radius']:.4f}")
    entry["findings"] = findings(primaries, slows, ends)
    radius = grids[0].radius.values.tolist()
    entry["settings"] = {"spins": spins, "radii": radius, "inclined": inclined, "tubes": tubes, "orders": orders}
    entry["seconds"] = time.perf_counter() - began
    figure = picture(grids[0], sections, highers, (WIDTH, RAUCH_BLANDFORD, SHIFT, DRIFT))
    return [*write_study(output, "far_camera", __doc__, figure, text, **entry), *stores]
