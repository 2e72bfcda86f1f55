"""Do caustics, star images and great circles keep what they claim, over random cameras?

    python -m studies.adversary.curves_and_stars CAUSTICS STARS CIRCLES

- Extremes of caustics, theta' and phi' in turn: those of the default engine against those of the integrator alone. They
  may differ by the sum of both reported errors.
- Stars: directions are drawn on the sheets of index 0 to 2, one in four next to a critical curve, and traced to the
  celestial sphere by the integrator. Where the images of the star that lies there are certified, the direction must be
  among them, no two of them may be one, and each must lead to the star, with its index, by the integrator again.
- Great circles with random normals: how many are certified. Every claimed curve must run over its circle, and each
  pair event must lie on it.

Prints what was tried, and every counterexample as a line of Python.
"""

import math
import sys
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.images.search import search
from kerrcaustics.images.sheets import Sheets, sheets_of
from kerrcaustics.lens_map import sky_lines
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.sphere import angle_between, from_angles

Array = np.ndarray

EXTREMES = ("theta_min", "theta_max", "phi_min", "phi_max")
# Largest Morse index, and orders of caustics.
MAX_INDEX, ORDERS = 2, 3
# True error over reported error that is still a kept promise.
HONEST = 10.0
# Stars of one camera, and circles.
_STARS, _CIRCLES = 300, 20
_TOLERANCE = 1e-13


def cameras(seed: int) -> Iterator[kc.Camera]:
    """Random cameras at rest: small, middling and nearly extremal spins, near and far, on the equator and off it."""
    rng = np.random.default_rng(seed)
    while True:
        small, fast = 10 ** rng.uniform(-3, -0.5), 1 - 10 ** rng.uniform(-4, -0.5)
        spin = float(rng.choice([small, fast, rng.uniform(0, 1)]))
        radius = float(kerr.horizon(spin) * (1 + 10 ** rng.uniform(-1, 2)))
        inclination = float(rng.choice([math.pi / 2, math.acos(rng.uniform(-1, 1))]))
        yield kc.Camera(spin, radius, inclination)


def caustic_extremes(camera: kc.Camera) -> list[tuple[float, str]]:
    """Difference over reported errors of every extreme, between the default engine and the integrator, and its name."""
    default, other = (kc.caustics(camera, ORDERS, engine) for engine in ("auto", "integrated"))
    found = []
    for one in default:
        for two in (two for two in other if two.order == one.order):
            for name in EXTREMES:
                miss = abs(getattr(one, name) - getattr(two, name)) / (one.error + two.error)
                found.append((float(miss), f"order {one.order}, {name}, of kc.caustics({camera!r})"))
    return found


def chosen(sheets: Sheets, count: int, rng: np.random.Generator) -> Array:
    """Directions (count, 3) on the sky at rest, on all sheets, one in four next to a critical curve."""
    turn, index = rng.uniform(0, 2 * math.pi, count), rng.integers(0, len(sheets.sheets), count)
    gap = 10 ** rng.uniform(-6, -1, count)
    part = np.where(rng.uniform(size=count) < 0.75, rng.uniform(0.01, 0.99, count), 1 - gap)
    depth = np.choose(index, [sheet.depth(turn, part) for sheet in sheets.sheets])
    return sheets.sky(sky_lines.line_of_sight(sheets.camera, turn, depth))


def star_claims(camera: kc.Camera, count: int, rng: np.random.Generator) -> tuple[dict[str, int], list[str]]:
    """Numbers of stars that were tried and certified, and broken claims."""
    sheets = sheets_of(camera, MAX_INDEX)
    sky = chosen(sheets, count, rng)
    beams = beams_of_directions(sheets.camera, sky, "integrated", _TOLERANCE, crossings=False, redshift=False)
    good = beams.escaped & (np.asarray(beams.index) <= MAX_INDEX)
    sky, star, width = sky[good], beams.direction[good], np.abs(beams.delta_minus[good])
    found = search(sheets, star)
    images = found.images
    # A chosen direction is itself an image, as well as its beam is known.
    blur = HONEST * (beams.error[good] / width)
    away = np.full(len(star), np.inf)
    np.minimum.at(away, images.star, angle_between(images.sky, sky[images.star]) - HONEST * images.error)
    missed = found.certified & (away > blur)
    traced = beams_of_directions(sheets.camera, images.sky, "integrated", _TOLERANCE, crossings=False, redshift=False)
    off = angle_between(traced.direction, star[images.star])
    allowed = HONEST * (traced.error + images.error * np.abs(traced.delta_plus))
    invented = np.zeros(len(star), bool)
    invented[images.star[(off > allowed) | (traced.index != images.index)]] = True
    doubled = _doubled(images.star, images.index, images.sky, images.error, len(star))
    broken = []
    for name, which in (("missed", missed), ("invented", invented), ("doubled", doubled)):
        for i in np.flatnonzero(which & found.certified):
            broken.append(f"{name}: sheets_of({camera!r}, {MAX_INDEX}), star {star[i].tolist()}, N {sky[i].tolist()}")
    reported = {"stars": len(star), "images": len(images.star), "certified": int(found.certified.sum())}
    return reported | {"on a caustic": int(found.on_caustic.any(axis=1).sum())}, broken


def _doubled(star: Array, index: Array, sky: Array, error: Array, count: int) -> Array:
    """Stars two of whose images of one index are closer than their errors."""
    twice = np.zeros(count, bool)
    for i in np.unique(star):
        these = np.flatnonzero(star == i)
        gaps = angle_between(sky[these][:, None], sky[these])
        close = gaps <= error[these][:, None] + error[these]
        alike = close & (index[these][:, None] == index[these])
        twice[i] = np.count_nonzero(alike) > len(these)
    return twice


def circle_claims(camera: kc.Camera, count: int, rng: np.random.Generator) -> tuple[dict[str, int], list[str]]:
    """Numbers of random great circles that were tried and certified, and broken claims."""
    certified, broken = 0, []
    for _ in range(count):
        normal = (float(np.arccos(rng.uniform(-1, 1))), float(rng.uniform(-math.pi, math.pi)))
        circle = kc.circle_images(camera, normal, MAX_INDEX)
        certified += circle.certified
        name = f"kc.circle_images({camera!r}, {normal!r}, {MAX_INDEX})"
        if not circle.certified:
            broken.append(f"not certified: {name}: {circle.remarks}")
            continue
        for curve in circle.curves:
            beams = beams_of_directions(camera, curve.sky, "integrated", _TOLERANCE, crossings=False, redshift=False)
            height = np.abs(beams.direction @ from_angles(*normal))
            if (height > HONEST * (curve.error * beams.delta_plus + beams.error)).any():
                broken.append(f"off its circle by {height.max():.1g}: {name}")
    return {"circles": count, "certified": int(certified)}, broken


def try_all(
    caustics: int, stars: int, circles: int, seed: int = 2015, report: Callable[[object], None] = lambda _line: None
) -> tuple[dict[str, dict[str, float]], list[str]]:
    """So many extremes, stars and circles over random cameras: numbers by what was tried, and broken claims.

    report: called with the numbers so far after each camera, and with its broken claims.
    """
    rng, source = np.random.default_rng((seed, 1)), cameras(seed)
    numbers: dict[str, dict[str, float]] = {"extremes": {"extremes": 0, "largest": 0.0}, "stars": {}, "circles": {}}
    broken: list[str] = []
    while numbers["extremes"]["extremes"] < caustics:
        for miss, name in caustic_extremes(next(source)):
            numbers["extremes"]["extremes"] += 1
            numbers["extremes"]["largest"] = max(numbers["extremes"]["largest"], miss)
            broken += [f"{miss:.1f} times the errors: {name}"] if miss > HONEST else []
        report(numbers["extremes"])
    for what, count, step, claims in (
        ("stars", stars, _STARS, star_claims),
        ("circles", circles, _CIRCLES, circle_claims),
    ):
        for done in range(0, count, step):
            reported, faults = claims(next(source), min(step, count - done), rng)
            numbers[what] = {name: numbers[what].get(name, 0) + number for name, number in reported.items()}
            broken += faults
            report((what, numbers[what], faults))
    return numbers, broken


if __name__ == "__main__":
    counts, counterexamples = try_all(*(int(word) for word in sys.argv[1:]), report=partial(print, flush=True))
    print(counts)
    print("\n".join(counterexamples) or "no claim is broken")
