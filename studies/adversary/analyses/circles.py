"""Isoradials, line profiles and spots: what is seen of circles in the plane, by integrated rays."""

import math
from typing import Any, NamedTuple

import numpy as np
from mpmath import mp, mpf

import kerrcaustics as kc
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.isoradials import Isoradial

from ...truth.camera import metric, photon, unit
from ..trials import place_of
from .claim import Claim, Kind
from .half_lines import UNKNOWN, WITHIN, CircleOnLines, HalfLines, circle_on, half_lines, shadow_on, sides
from .hard_viewers import Random, hard_radius, hard_viewer, one_of, power

Array = np.ndarray

# Senses of the emitters that circle.
_ORBITS = {"circular": 1, "retrograde": -1}
_LINES, _PLACES = 96, 300
# Rays on a half-line between the rims of a disk, and half-lines round about, of profiles.
_ON_CHORD, _ROUND = 24, 512
# Points of a curve that parts the sky.
_DENSE = 2000
# Half-lines of a spot's orbit, and steps of secants to the orbit on each.
_FINE, _SECANTS = (1024, 4096, 16384), 4


def worst(name: str, ratios: Array, code: str) -> Claim:
    """The largest of some ratios, at its place."""
    at = int(np.argmax(np.nan_to_num(ratios, nan=np.inf)))
    return Claim(name, float(ratios[at]), f"{code}  # at {at}")


def isoradial_claims(rng: Random) -> list[Claim]:
    """Places, azimuths, times and redshifts of isoradials by the rays there, and that nothing else is on the circle."""
    viewer = hard_viewer(rng, -6.0)
    radius, crossings = hard_radius(viewer.spin, rng), int(rng.integers(1, 4))
    motion = str(rng.choice(["circular", "retrograde", "plunging", "fiducial"]))
    points = int(rng.integers(16, 200))
    found = kc.isoradials(viewer, [radius], crossings, points, motion)
    code = f"kc.isoradials({viewer!r}, [{radius!r}], {crossings}, {points}, {motion!r})"
    claims: list[Claim] = []
    for number, curve in enumerate(found):
        claims += _ray_claims(curve, motion, f"{code}[{number}]")
    if found.certified:
        claims += _side_claims(viewer, radius, int(rng.integers(1, crossings + 1)), rng, code)
    return claims


def _ray_claims(curve: Isoradial, motion: str, code: str) -> list[Claim]:
    """Every point of a curve against an integrated beam in its direction."""
    end = kc.EquatorialPlane(curve.crossing, motion)
    beams = kc.trace_beams(curve.camera, curve.sky, "integrated", 1e-14, end=end, time=True, crossings=False)
    met = np.isfinite(beams.radius) & np.isfinite(beams.error)
    if not met.all():
        # A ray that grazes the horizon or leads to infinity: rounding of the direction decides.
        narrow = curve.error < 1e-3 * curve.width * curve.radius
        return [Claim("place", math.inf, f"{code}.sky[{i}]") for i in np.flatnonzero(~met & narrow)[:1]]
    assert beams.time is not None and curve.time is not None and curve.time_error is not None
    allowed = curve.error + curve.width * curve.radius * beams.error
    claims = [worst("place", np.abs(beams.radius - curve.radius) * curve.width / allowed, code)]
    turned = np.angle(np.exp(1j * (beams.azimuth - curve.azimuth)))
    spread = curve.error * beams.delta_plus / curve.radius + beams.azimuth_error + 4e-16 * np.abs(beams.azimuth)
    claims.append(worst("azimuth", np.abs(turned) / spread, code))
    claims.append(worst("time", np.abs(beams.time - curve.time) / (curve.time_error + beams.time_error), code))
    if motion in _ORBITS:
        claims += _redshift_claims(curve, _ORBITS[motion], code)
    return claims


def _redshift_claims(curve: Isoradial, sense: int, code: str) -> list[Claim]:
    """Frequency ratios of circling emitters in long arithmetic: Bardeen, Press & Teukolsky 1972, 2.16."""
    chosen = np.arange(0, len(curve.sky), max(len(curve.sky) // 6, 1))
    chosen = chosen[np.isfinite(curve.redshift[chosen])]
    if not len(chosen):
        return []
    with mp.workdps(40):
        a, r = mpf(curve.camera.spin), mpf(curve.radius)
        orbital = 1 / (a + sense * r ** mpf(1.5))
        slow = mp.sqrt(1 - (r**2 + a**2) * orbital**2 - 2 / r * (1 - a * orbital) ** 2)
        true = [float(energy * slow / (1 - orbital * b)) for energy, b in (_light_of(curve, int(i)) for i in chosen)]
    return [worst("redshift", np.abs(curve.redshift[chosen] - true) / curve.redshift_error[chosen], code)]


def _light_of(curve: Isoradial, point: int) -> tuple[Any, Any]:
    """Energy, by that at infinity, as the viewer measures it, and axial angular momentum, of the light of a point."""
    viewer: Any = curve.camera
    if math.isinf(viewer.radius):
        return mpf(1), -mpf(curve.sky[point, 0]) * mp.sin(mpf(viewer.inclination))
    sky = [mpf(part) for part in curve.sky[point]]
    if isinstance(viewer, kc.Observer):
        # Tangents of half the angle from the hole.
        x, y = (part / (2 * mpf(viewer.radius)) for part in sky)
        square = x**2 + y**2
        sky = [-(1 - square) / (1 + square), 2 * x / (1 + square), 2 * y / (1 + square)]
    # Observers are at rest with the FIDO.
    place = place_of(viewer)
    at, n = metric(place), unit(sky)
    light = photon(place, n)
    return mp.sqrt(1 - at.speed**2) * light.energy / (1 - at.speed * n[1]), light.b


def _side_claims(viewer: Viewer, radius: float, crossing: int, rng: Random, code: str) -> list[Claim]:
    """Places anywhere, and beside the curve: the closed curve parts what is met within the circle from all else."""
    lines = half_lines(viewer, _PLACES, 3 * radius + 100)
    if lines is None:
        return []
    lines = lines._replace(angle=rng.uniform(0, 2 * np.pi, _PLACES))
    shadow = shadow_on(lines)
    curve = next(one for one in kc.isoradials(viewer, [radius], crossing, _DENSE) if one.crossing == crossing)
    turn, away = polar(lines, curve.sky)
    near = away[rng.integers(len(away), size=_PLACES)] - shadow
    part = rng.uniform(size=_PLACES)
    beside = shadow + near * (1 + rng.choice([-1, 1], _PLACES) * 10 ** rng.uniform(-3, -0.3, _PLACES))
    distance = np.clip(np.where(part < 0.5, beside, part**2 * lines.last), 0, 0.999 * lines.last)
    seen = sides(viewer, lines.at(distance), crossing, radius)
    within, apart = _inside(_flat(lines, turn, away), _flat(lines, lines.angle, distance))
    wrong = apart & (seen != UNKNOWN) & ((seen == WITHIN) != within)
    first = lines.at(distance)[np.argmax(wrong)].tolist()
    return [Claim("side", math.inf if wrong.any() else 0.0, f"{code}  # crossing {crossing} at {first}")]


def _flat(lines: HalfLines, turn: Array, distance: Array) -> Array:
    """Places as complex numbers: on a screen as they are, of a sky in stereographic projection from the centre."""
    return (distance if len(lines.centre) == 2 else np.tan(distance / 2)) * np.exp(1j * turn)


def _inside(curve: Array, places: Array) -> tuple[Array, Array]:
    """Whether a closed polygon winds round places, and whether they are farther from it than it is from the curve."""
    away = curve - places[:, None]
    steps = np.abs(np.roll(curve, -1) - curve)
    winding = np.angle(np.roll(away, -1, axis=1) / away).sum(axis=1)
    reach = 3 * np.maximum(steps, np.roll(steps, 1))
    return np.abs(winding) > np.pi, np.all(np.abs(away) > reach, axis=1)


def polar(lines: HalfLines, places: Array) -> tuple[Array, Array]:
    """Angles (0 to 2 pi) and distances from the centre of half-lines."""
    if len(lines.centre) == 2:
        away = places - lines.centre
        return np.arctan2(away[:, 1], away[:, 0]) % (2 * np.pi), np.hypot(*away.T)
    first, second = kc.tangent_basis(lines.centre)
    turn = np.arctan2(places @ second, places @ first) % (2 * np.pi)
    return turn, 2 * np.arcsin(np.minimum(np.linalg.norm(places - lines.centre, axis=1) / 2, 1))


class _Seen(NamedTuple):
    """Integrated rays at places (..., k): radius, azimuth, time, frequency ratio."""

    radius: Array
    azimuth: Array
    time: Array
    redshift: Array


def _seen(viewer: Viewer, places: Array, end: kc.EquatorialPlane) -> _Seen:
    flat = places.reshape(-1, places.shape[-1])
    rays = kc.trace_rays(viewer, flat, "integrated", 1e-13, end=end, time=True, redshift=True)
    assert rays.time is not None and rays.redshift is not None
    return _Seen(*(part.reshape(places.shape[:-1]) for part in (rays.radius, rays.azimuth, rays.time, rays.redshift)))


def line_profile_claims(rng: Random) -> list[Claim]:
    """Light in bins, and in all of them, against sums along half-lines on which g is a polynomial."""
    viewer = hard_viewer(rng, -2.0)
    motion = str(rng.choice(["circular", "plunging", "fiducial"]))
    isco, horizon = kerr.isco(viewer.spin), kerr.horizon(viewer.spin)
    inner = isco * (1 + power(rng, -9, 0.5)) if motion == "circular" else horizon + power(rng, -2, 1)
    outer = inner * (1 + power(rng, -2, 1))
    crossing, law = int(rng.integers(1, 4)), one_of(rng, 0.0, 3.0, rng.uniform(-1, 5))
    # So many nodes as to see whether the error is honest where they are few, too.
    radii, turns = int(rng.choice([8, 16, 32])), int(rng.choice([64, 128, 256]))
    sizes = {"crossing": crossing, "motion": motion, "bins": 8, "radii": radii, "turns": turns}
    profile = kc.line_profile(viewer, inner, outer, law, **sizes)
    words = ", ".join(f"{name}={value!r}" for name, value in sizes.items())
    code = f"kc.line_profile({viewer!r}, {inner!r}, {outer!r}, {law!r}, {words})"
    if not np.isfinite(profile.error).all():
        return []
    true = _true_profile(viewer, (inner, outer), law, kc.EquatorialPlane(crossing, motion), profile.edges)
    if true is None:
        return []
    light, off = true
    ratio = np.abs(profile.flux - light) / (profile.error + off)
    total = abs(profile.flux.sum() - light.sum()) / (profile.error.sum() + abs(off.sum()))
    return [worst("bin", ratio, code), Claim("total", float(total), code)]


def _true_profile(
    viewer: Viewer, radii: tuple[float, float], law: float, end: kc.EquatorialPlane, edges: Array
) -> tuple[Array, Array] | None:
    """Light in bins, and its errors: from half of the half-lines, and from fewer rays on each."""
    lines = half_lines(viewer, _ROUND, 3 * radii[1] + 100)
    if lines is None:
        return None
    shadow = shadow_on(lines)
    inner, outer = (circle_on(lines, shadow, end.crossing, radius) for radius in radii)
    if inner is None or outer is None:
        return None
    sums, size = [], 0.0
    for count in (_ON_CHORD, _ON_CHORD - 8):
        node = np.polynomial.chebyshev.chebpts1(count)
        distance = inner.distance + (outer.beyond - inner.beyond) * (1 + node[:, None]) / 2
        seen = _seen(viewer, lines.at(distance), end)
        light = seen.redshift**4 * seen.radius**-law * lines.density(distance) * (outer.beyond - inner.beyond) / 2
        if not np.isfinite(light).all():
            return None
        fine, coarse = (_in_bins(seen.redshift, light, edges, parts) * 2 * np.pi / _ROUND for parts in (400, 200))
        sums += [fine.sum(axis=1), 2 * fine[:, ::2].sum(axis=1), coarse.sum(axis=1)]
        size = np.abs(light / (outer.beyond - inner.beyond)).max(axis=0)
    # Sides of bins touch lines of equal g: there the sum converges as the power 3 / 2 of the step, and what one bin
    # has too much its neighbour has too little.
    change = np.pad(sum(np.abs(sums[0] - other) for other in sums[1:4]), 1)
    rough = 2 * np.maximum(np.maximum(change[:-2], change[2:]), change[1:-1]) + 0.1 * change.max()
    rims = 2 * float(size @ (inner.error + outer.error)) * 2 * np.pi / _ROUND
    return sums[0], rough + rims


def _in_bins(shift: Array, light: Array, edges: Array, parts: int) -> Array:
    """Integrals (bins, k) over -1 to 1 of functions through Chebyshev nodes (m, k), where another one is in a bin."""
    fine = np.linspace(-1, 1, parts + 1)
    places = np.polynomial.chebyshev.chebpts1(len(shift))
    turned = np.polynomial.chebyshev.chebvander(places, len(places) - 1)
    g, f = (np.linalg.solve(turned, part) for part in (shift, light))
    whole = np.polynomial.chebyshev.chebint(f)
    below = np.polynomial.chebyshev.chebvander(fine, len(whole) - 1) @ whole
    values = np.polynomial.chebyshev.chebvander(fine, len(g) - 1) @ g
    sums = np.empty((len(edges), shift.shape[1]))
    for i, edge in enumerate(edges):
        low, high = values[:-1] - edge, values[1:] - edge
        # The part of each short step that lies below the edge, the function being linear in it.
        with np.errstate(divide="ignore", invalid="ignore"):
            part = np.where(
                low < 0, np.where(high < 0, 1, low / (low - high)), np.where(high < 0, high / (high - low), 0)
            )
        sums[i] = (part * np.diff(below, axis=0)).sum(axis=0)
    return np.diff(sums, axis=0)


def spot_claims(rng: Random) -> list[Claim]:
    """Fluxes of a spot at some times, against sums over half-lines through the images of its orbit."""
    viewer = hard_viewer(rng, -2.0)
    motion = str(rng.choice(["circular", "retrograde"]))
    orbit = kerr.photon_orbits(viewer.spin)[int(motion == "retrograde")]
    radius = one_of(rng, orbit * (1 + power(rng, -2, 0)), kerr.isco(viewer.spin), orbit + power(rng, 0, 2))
    size, bright = radius * power(rng, -1.7, -0.5), one_of(rng, 4.0, 0.0, 3.5)
    spot = kc.Spot(size, motion=motion, crossings=int(rng.integers(1, 4)), power=bright)
    light = kc.light_curve(viewer, radius, 8, source=spot)
    code = f"kc.light_curve({viewer!r}, {radius!r}, 8, source=kc.{spot!r})"
    lines = half_lines(viewer, _LINES, 3 * radius + 100)
    if not light.certified or lines is None:
        return []
    shadow, claims = shadow_on(lines), []
    for number, share in enumerate(light.shares):
        true = _true_spot(lines, shadow, spot, radius, number + 1, light.time)
        if true is not None:
            # The error is that of all light.
            claims.append(worst("share", np.abs(share - true[0]) / (light.error + true[1]), f"{code}.shares[{number}]"))
    return claims


def _true_spot(
    lines: HalfLines, shadow: Array, spot: kc.Spot, radius: float, crossing: int, time: Array
) -> tuple[Array, Array] | None:
    """Light at times through one crossing, and its error from half of the half-lines."""
    circle = circle_on(lines, shadow, crossing, radius)
    if circle is None:
        return None
    end = kc.EquatorialPlane(crossing, spot.motion)
    for count in _FINE:
        fine = lines._replace(angle=np.arange(count) * 2 * np.pi / count)
        found = _orbit_on(fine, circle, end, radius)
        if found is None:
            return None
        true = _spot_sum(fine, end, spot, radius, *found, time)
        if true is not None:
            return true
    return None


def _spot_sum(
    fine: HalfLines,
    end: kc.EquatorialPlane,
    spot: kc.Spot,
    radius: float,
    distance: Array,
    step: Array,
    time: Array,
) -> tuple[Array, Array] | None:
    """The sum over half-lines, and its error; None where they are too few."""
    seen = _seen(fine.viewer, fine.at(distance), end)
    slope, off = _slope(fine, end, distance, step)
    orbital = 1 / (fine.viewer.spin + (1 if spot.motion == "circular" else -1) * radius**1.5)
    late, width = seen.azimuth - orbital * (time[:, None] - seen.time), spot.size / radius
    turned = np.angle(np.exp(1j * late))
    between = np.angle(np.exp(1j * (np.roll(late[0], 1) - late[0])))
    if not np.abs(between).max() < width / 2:
        return None
    copies = turned[..., None] + 2 * np.pi * np.arange(-2, 3)
    profile = np.exp(-((copies / width) ** 2) / 2).sum(axis=-1) / (math.sqrt(2 * np.pi) * width)
    each = profile * seen.redshift**spot.power * fine.density(distance) / slope / radius * 2 * np.pi / len(distance)
    if not np.isfinite(each).all():
        return None
    total, half = each.sum(axis=1), 2 * each[:, ::2].sum(axis=1)
    return total, np.abs(total - half) + (each * off).sum(axis=1) + 1e-9 * total.max()


def _slope(fine: HalfLines, end: kc.EquatorialPlane, distance: Array, step: Array) -> tuple[Array, Array]:
    """|dr / d distance| by differences, and its relative error from those of lower order."""
    rises = [
        (
            _seen(fine.viewer, fine.at(distance + k * step), end).radius
            - _seen(fine.viewer, fine.at(distance - k * step), end).radius
        )
        / (2 * k * step)
        for k in (1, 2)
    ]
    slope = (4 * rises[0] - rises[1]) / 3
    return np.abs(slope), np.abs(rises[0] / slope - 1)


def _orbit_on(
    fine: HalfLines, circle: CircleOnLines, end: kc.EquatorialPlane, radius: float
) -> tuple[Array, Array] | None:
    """Distances from the centre at which many half-lines meet an orbit, and steps for slopes there."""
    series = np.fft.rfft(circle.distance) / len(circle.distance)
    start = np.fft.irfft(series, len(fine.angle)) * len(fine.angle)
    reach = np.fft.irfft(np.fft.rfft(np.log(np.abs(circle.beyond))) / len(circle.beyond), len(fine.angle))
    reach = np.exp(reach * len(fine.angle))
    distance, step, move = start, 1e-5 * reach, reach
    for _ in range(_SECANTS):
        low, high = (_seen(fine.viewer, fine.at(distance + k * step), end).radius for k in (-1, 1))
        move = (radius - (low + high) / 2) * 2 * step / (high - low)
        if not (np.abs(move) < reach).all():
            return None
        distance = distance + move
    if not (np.abs(move) < 1e-7 * reach).all():
        return None
    return distance, step


KINDS: dict[str, Kind] = {
    "isoradials": isoradial_claims,
    "line profiles": line_profile_claims,
    "spots": spot_claims,
}
