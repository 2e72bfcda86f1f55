"""Check that every caustic is a closed astroid with four cusps, and mirror symmetric where it must be.

    kerrcaustics study astroids

Random cameras, and extreme ones by name, orders 1 to 4 or more. Each caustic must pass the check of `kerrcaustics
check`, and that by beams traced anew, by the integrator: at a cusp the curve turns back along the major axis of the
beam, and round an astroid that axis turns once. Writes astroids.json, .png and .md; caustics that are no astroids are
listed with the reason.
"""

import math
import time
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.report.checks import CausticCheck, Outcome, caustic_outcome
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table
from kerrcaustics.spacetime import kerr

QUESTION = "Is every caustic an astroid with four cusps?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 175
QUICK_SECONDS = 6

CAMERAS, ORDERS = 200, 4

# Spin, radius in horizon radii, inclination in degrees, orders.
NAMED = {
    "no spin": (0.0, 3.0, 90.0, 4),
    "spin 1e-6": (1e-6, 3.0, 90.0, 4),
    "spin 1e-4": (1e-4, 3.0, 90.0, 4),
    "spin 1 - 1e-6": (1 - 1e-6, 6.0, 90.0, 4),
    "spin 1 - 1e-6, 60 degrees": (1 - 1e-6, 6.0, 60.0, 4),
    "next to the horizon": (0.9, 1.0001, 90.0, 4),
    "next to the horizon, 60 degrees": (0.999, 1.001, 60.0, 4),
    "far": (0.9, 1e5, 90.0, 4),
    "far, 30 degrees": (0.999, 1e5, 30.0, 4),
    "on the axis": (0.9, 4.0, 0.0, 4),
    "0.001 degrees from the axis": (0.9, 4.0, 1e-3, 4),
    "0.1 degrees from the axis": (0.9, 4.0, 0.1, 4),
    "high orders": (0.9, 4.0, 90.0, 7),
    "high orders, 50 degrees": (0.5, 50.0, 50.0, 7),
}
SHOWN = (
    ("slow hole", 0.3, 6.03, 90.0),
    ("from 60°", 0.9, 6.03, 60.0),
    ("JTFT's", 0.999, 2.6, 90.0),
    ("far, near the axis", 0.999, 1000.0, 20.0),
)
"""Cameras of the picture: what they are, spin, radius, inclination in degrees."""


@dataclass(frozen=True)
class Check:
    """Findings about one caustic.

    verdict: "astroid"; "too small" (a point, or so small that no cusps are claimed); "incomplete" (points are missing),
    or "other". cusps and turns: counted with beams traced anew, turns of the major axis round the curve (None for a
    point); size: in units of the caustic's error; deviation: of these beams from the caustic, and mirror: of the
    caustic of the camera reflected in the equator, both in units of both errors. None where it was not asked.
    faults: those that `kerrcaustics check` finds.
    """

    camera: str
    spin: float
    radius: float
    inclination: float
    order: int
    verdict: str
    cusps: int | None
    turns: float | None
    size: float
    deviation: float | None
    mirror: float | None
    faults: tuple[str, ...]


def reversals(camera: kc.Camera, caustic: kc.Caustic) -> tuple[int, float, float]:
    """Cusps and turns of the major axis counted with beams traced anew, and their deviation in units of both errors."""
    beams = kc.trace_beams(camera, caustic.sky, "integrated", 1e-12, crossings=False, redshift=False)
    angle = np.asarray(beams.position_angle)
    # An axis has no sign: its angle is followed modulo pi.
    steps = np.diff(angle, append=angle[0])
    steps -= math.pi * np.round(steps / math.pi)
    half_turns = steps.sum() / math.pi
    axis = angle[0] + np.append(0.0, np.cumsum(steps[:-1]))
    theta, phi = caustic.celestial.T
    chord = np.roll(caustic.celestial, -1, axis=0) - np.roll(caustic.celestial, 1, axis=0)
    forward = chord[:, 0] * np.cos(axis) + np.sin(theta) * chord[:, 1] * np.sin(axis) > 0
    # After an odd number of half turns the axis points the other way.
    again = forward[0] ^ bool(round(half_turns) % 2)
    there = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    # The caustic's error is that of its angles, larger than that of the direction where phi' is uncertain.
    allowed = caustic.error * np.sin(theta) + np.asarray(beams.error)
    away = np.linalg.norm(np.asarray(beams.direction) - there, axis=-1) / allowed
    return int((forward != np.append(forward[1:], again)).sum()), float(half_turns / 2), float(away.max())


def mirrored_by(caustic: kc.Caustic, image: kc.Caustic) -> float:
    """Distance of two caustics from mirror images in the equator, in units of both errors: extremes and cusps."""
    ends = [
        caustic.theta_min + image.theta_max - math.pi,
        caustic.theta_max + image.theta_min - math.pi,
        caustic.phi_min - image.phi_min,
        caustic.phi_max - image.phi_max,
    ]
    if len(caustic.cusps) == len(image.cusps) > 0:
        reflected = np.array([(math.pi - cusp.celestial[0], cusp.celestial[1]) for cusp in image.cusps])
        ends += [np.abs(reflected - cusp.celestial).max(axis=1).min() for cusp in caustic.cusps]
    return float(np.abs(ends).max() / (caustic.error + image.error))


def astroid_check(camera: kc.Camera, caustics: CausticSet, order: int) -> Outcome:
    """What `kerrcaustics check` says of a caustic that must be a closed astroid with four cusps."""
    place = {"spin": camera.spin, "radius": camera.radius, "inclination": math.degrees(camera.inclination)}
    return caustic_outcome(CausticCheck(**place, order=order, kind="astroid", closed=True, cusps=4), caustics)


def verdict(
    caustic: kc.Caustic, outcome: Outcome, cusps: int | None, turns: float | None, deviation: float | None
) -> str:
    """The kind of a caustic, by the check and by the count."""
    if caustic.kind in ("point", "unresolved"):
        return "too small"
    if not caustic.closed:
        return "incomplete"
    # The major axis of a beam turns forward for odd orders, backward for even ones.
    once = turns is not None and abs(turns + (-1) ** caustic.order) < 1e-6
    confirmed = cusps == 4 and once and deviation is not None and deviation < 1
    return "astroid" if outcome.met and confirmed else "other"


def checks(name: str, camera: kc.Camera, orders: int, mirror: bool) -> list[Check]:
    """All caustics of one camera checked; mirror: against those of the camera below the equator, too."""
    found = kc.caustics(camera, orders=orders)
    images: dict[int, kc.Caustic] = {}
    if mirror:
        below = kc.Camera(camera.spin, camera.radius, math.pi - camera.inclination, velocity="fiducial")
        images = {caustic.order: caustic for caustic in kc.caustics(below, orders=orders)}
    rows = []
    for caustic in found:
        cusps, turns, away = (None, None, None) if caustic.kind == "point" else reversals(camera, caustic)
        outcome = astroid_check(camera, found, caustic.order)
        rows.append(
            Check(
                name,
                camera.spin,
                camera.radius,
                math.degrees(camera.inclination),
                caustic.order,
                verdict(caustic, outcome, cusps, turns, away),
                cusps,
                turns,
                max(caustic.theta_extent, caustic.phi_extent) / caustic.error,
                away,
                mirrored_by(caustic, images[caustic.order]) if caustic.order in images else None,
                outcome.faults,
            )
        )
    place = (name, camera.spin, camera.radius, math.degrees(camera.inclination))
    lost = [
        Check(*place, order, "incomplete", None, None, 0.0, None, None, astroid_check(camera, found, order).faults)
        for order in found.missing
    ]
    return rows + lost


def random_cameras(count: int) -> list[kc.Camera]:
    """Cameras of any spin (half of them close to 1), radius and inclination, a third of them on the equator."""
    chance = np.random.default_rng(1502)
    cameras = []
    for i in range(count):
        spin = float(chance.uniform(0.02, 1) if i % 2 else 1 - 10 ** chance.uniform(-4, -0.5))
        radius = 1.02 * kerr.horizon(spin) * 10 ** float(chance.uniform(0, 4))
        inclination = math.acos(float(chance.uniform(-1, 1)))
        cameras.append(kc.Camera(spin, radius, inclination if i % 3 else math.pi / 2, velocity="fiducial"))
    return cameras


def caustic_panel(ax: Axes, caustic: kc.Caustic) -> None:
    """A caustic stretched to fill its panel, with its size."""
    theta, phi = np.degrees(np.vstack([caustic.celestial, caustic.celestial[:1]])).T
    ax.plot(phi, theta, **style.order_line(caustic.order))
    for cusp in caustic.cusps:
        ax.plot(*np.degrees(cusp.celestial[::-1]), ".", color=style.order_colour(caustic.order), markersize=4)
    ax.invert_yaxis()
    ax.set(xticks=[], yticks=[])
    sizes = np.degrees([caustic.phi_extent, caustic.theta_extent])
    ax.set_xlabel(" × ".join(f"{size:.3g}°" if size < 1000 else f"{size:.0f}°" for size in sizes), labelpad=2)


def picture(shown: tuple[tuple[str, float, float, float], ...], orders: int) -> Figure:
    """The figure of the study: a column of caustics for each of some cameras."""
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 1.6 * orders + 0.5), layout="constrained")
        grid = figure.subplots(orders, len(shown), squeeze=False)
        for column, (name, spin, radius, inclination) in zip(grid.T, shown, strict=True):
            camera = kc.Camera(spin, radius, math.radians(inclination), velocity="fiducial")
            for ax, caustic in zip(column, kc.caustics(camera, orders=orders), strict=True):
                caustic_panel(ax, caustic)
            column[0].set_title(f"{name}\na = {spin:g}, r = {radius:g}, {inclination:g}°")
        for order, ax in enumerate(grid[:, 0], 1):
            ax.set_ylabel(style.order_name(order))
    return figure


def table(rows: list[Check]) -> str:
    """Verdicts by group of cameras as a Markdown table."""
    heads = [
        "cameras",
        "caustics",
        "astroids",
        "too small",
        "others",
        "largest deviation",
        "largest mirrored",
    ]
    lines = []
    for name in dict.fromkeys(row.camera for row in rows):
        group = [row for row in rows if row.camera == name]
        counts = Counter(row.verdict for row in group)
        measured = [
            [value for value in column if value is not None]
            for column in ([row.deviation for row in group], [row.mirror for row in group])
        ]
        numbers = [len(group), counts["astroid"], counts["too small"], counts["incomplete"] + counts["other"]]
        lines.append([name, *map(str, numbers), *(f"{max(values):.2g}" if values else "" for values in measured)])
    return markdown_table(heads, lines)


def findings(rows: list[Check]) -> list[str]:
    """Findings, a sentence for each question."""
    counts = Counter(row.verdict for row in rows)
    deviations = [row.deviation for row in rows if row.deviation is not None and row.verdict == "astroid"]
    found = [
        f"{counts['astroid']} of {len(rows)} caustics are closed astroids: in beams traced anew, which end within "
        f"{max(deviations, default=0):.2g} of both errors, they have four cusps and the major axis turns once."
    ]
    small = [row for row in rows if row.verdict == "too small"]
    if small:
        traced = [row for row in small if row.cusps is not None]
        four = sum(row.cusps == 4 for row in traced)
        found.append(
            f"{len(small)} are too small for their error ({max(row.size for row in small):.0f} times it or less): "
            f"{len(small) - len(traced)} points, and {len(traced)} others, {four} of which show four cusps."
        )
    found.append(f"{counts['incomplete']} are incomplete; {counts['other']} are anything else.")
    mirrored = [row.mirror for row in rows if row.mirror is not None and row.verdict == "astroid"]
    if mirrored:
        found.append(
            f"{len(mirrored)} caustics of cameras off the equator are the mirror images of those of the camera on its "
            f"other side, within {max(mirrored):.2g} of both errors."
        )
    return found


QUICK: dict[str, Any] = {
    "cameras": 24,
    "named": ("no spin", "spin 1 - 1e-6", "next to the horizon", "far, 30 degrees", "0.001 degrees from the axis"),
}
"""Arguments of `main` for a quick run."""


def main(
    output: Path,
    cameras: int = CAMERAS,
    orders: int = ORDERS,
    named: tuple[str, ...] = tuple(NAMED),
    shown: tuple[tuple[str, float, float, float], ...] = SHOWN,
) -> list[Path]:
    """Run the study; the files in `output`."""
    began = time.perf_counter()
    rows: list[Check] = []
    for camera in random_cameras(cameras):
        equatorial = camera.inclination == math.pi / 2
        name = "random, on the equator" if equatorial else "random, off the equator"
        rows += checks(name, camera, orders, mirror=not equatorial)
    for name in named:
        spin, part, inclination, most = NAMED[name]
        camera = kc.Camera(spin, part * kerr.horizon(spin), math.radians(inclination), velocity="fiducial")
        rows += checks(name, camera, most, mirror=False)
    rows.sort(key=lambda row: row.camera != "random, on the equator" if row.camera.startswith("random") else 2)
    text = table(rows)
    print(text)
    exceptions = [row for row in rows if row.verdict != "astroid"]
    for row in exceptions:
        where = f"a = {row.spin:.6g}, r = {row.radius:.5g}, {row.inclination:.4g} degrees, order {row.order}"
        print(f"{row.verdict}: {where}: {'; '.join(row.faults)}")
    return write_study(
        output,
        "astroids",
        __doc__,
        picture(shown, min(orders, ORDERS)),
        text,
        settings={"random cameras": cameras, "orders": orders, "named cameras": len(named)},
        findings=findings(rows),
        verdicts=Counter(row.verdict for row in rows),
        exceptions=[asdict(row) for row in exceptions],
        caustics=[asdict(row) for row in rows],
        seconds=time.perf_counter() - began,
    )
