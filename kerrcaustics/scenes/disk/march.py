"""Rays marched through a volume, front to back: their paths in steps, and the light that each step adds.

Paths are followed backward in Mino time, in the variables of docs/conventions.md: u = 1 / r, the unit vector m, and the
angle psi by which m is turned about the spin axis. Steps are those of Nystroem's method of order 4. If the width of the
beam counts, two neighbours of each ray are followed in the same steps.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from kerrcaustics.scenes.colour import seen_black_body
from kerrcaustics.scenes.disk.orbiting_spots import RayPart, SpotTraces
from kerrcaustics.scenes.disk.volume import Volume
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.frame import photon_of, potential_coefficients, redshift as sky_redshift
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Largest arc of a step, radians.
_ARC = 0.1
# Largest arc of a step within the volume, radians, before the factor of the march.
_ARC_WITHIN = 0.2
# Largest change of log r in a step within the volume, before the factor of the march.
_CHANGE_WITHIN = 0.4
# Smallest step, as a part of the usual one: rays do not stall just short of a rim.
_LEAST_STEP = 1e-3
# Transmission below which matter hides everything behind it.
_DARK = 1e-5
# Largest number of steps: more than any visible ray needs.
_MOST_STEPS = 20_000
# u = 1 / r below which outgoing photons escape: it lies beyond the outermost circular orbit of photons.
_NO_RETURN = 0.25
# Part of 1 / r at the horizon by which rays end above it, where their azimuth is infinite.
_ABOVE_HORIZON = 1e-3
# Distance of the neighbours, pixels: small enough for a linear map, large enough for round-off.
_APART = 1e-4
# cos theta below which a camera is in the plane.
_IN_PLANE = 1e-12
# Gauss's points in a step.
_GAUSS = (0.5 - 0.75**0.5 / 3, 0.5 + 0.75**0.5 / 3)


@dataclass(frozen=True)
class Marching:
    """Settings of marched rays.

    camera: the viewer.
    volume: matter in space, or spots with their streaks.
    beaming, colour_shift: switches of `render`.
    step: length of a step, as a part of the length over which the matter changes.
    crossings: number of the first crossings of the equatorial plane that divide the light of a ray.
    """

    camera: Viewer
    volume: Volume | SpotTraces
    beaming: bool
    colour_shift: bool
    step: float
    crossings: int = 0


class Marched(NamedTuple):
    """Light of n rays.

    Divided by k crossings, light and transmission have one more axis in front, of k + 1: the light from before the
    first crossing, from between it and the second, and so on, and the transmission up to each crossing and through all.

    light: (n, 3) linear sRGB light.
    transmission: (n,) part of the light behind that comes through.
    steps: number of steps of all rays.
    """

    light: Array
    transmission: Array
    steps: int


class _MarchedRays(NamedTuple):
    """State of n rays; each of them is one ray, or a beam of m = 3 with two neighbours if its width counts.

    constants: (5, m, n) a2, a1, a0, k and b.
    at_infinity: (n,) nu_camera / nu_infinity.
    place: (4, m, n) u and the unit vector.
    rate: (4, m, n) their derivatives by Mino time.
    psi: (m, n) angle by which the unit vector is turned about the spin axis.
    side: (n,) sign of cos theta until the next crossing of the plane.
    crossed: (n,) number of crossings so far.
    delay: (n,) coordinate time relative to the camera's, M, negative; 0 for a volume.
    """

    constants: Array
    at_infinity: Array
    place: Array
    rate: Array
    psi: Array
    side: Array
    crossed: Array
    delay: Array

    def part(self, which: Array) -> "_MarchedRays":
        """The chosen rays."""
        return _MarchedRays(*(value[..., which] for value in self))


def marched(marching: Marching, sky: Float[Array, "n 3"], steps: Float[Array, "n 3 2"]) -> Marched:
    """Rays of directions N (n, 3), through the whole volume; steps, of the directions to the pixels' neighbours."""
    light, transmission, step_count = marched_between(marching, sky, steps)
    return Marched(light.sum(axis=0), transmission[-1], step_count)


def marched_between(marching: Marching, sky: Float[Array, "n 3"], steps: Float[Array, "n 3 2"]) -> Marched:
    """Light and transmission as by `marched`, divided by crossings of the plane."""
    light, passing = np.zeros((marching.crossings + 1, len(sky), 3)), np.ones((marching.crossings + 1, len(sky)))
    transmission, step_count = np.ones(len(sky)), 0
    rays = _start_rays(marching, sky, steps)
    # Photons that cannot come from infinity have no unit of energy.
    number = np.flatnonzero(np.isfinite(rays.rate).all(axis=(0, 1)) & (rays.at_infinity > 0))
    rays = rays.part(number)
    for _ in range(_MOST_STEPS):
        live = _is_running(marching, rays) & (transmission[number] > _DARK)
        if not live.all():
            number, rays = number[live], rays.part(live)
        if not len(number):
            break
        width = _width(marching, rays)
        h = _step(marching, rays, width)
        after = _advanced(marching.camera.spin, rays, h)
        if isinstance(marching.volume, SpotTraces):
            after = after._replace(delay=rays.delay + _time_between(marching.camera.spin, rays, after, h))
        middle = (rays.place[0, 0] + after.place[0, 0]) / 2
        within = np.flatnonzero((middle > 1 / marching.volume.outer) & (middle < 1 / marching.volume.inner))
        if len(within) and isinstance(marching.volume, SpotTraces):
            _add_spots(
                marching, (rays.part(within), after.part(within), h[within]), width[within], number[within], light
            )
        elif len(within):
            inner = _steps_within(marching.camera.spin, rays.part(within), after.part(within), h[within])
            _add_step(marching, inner, width[within], number[within], (light, passing, transmission))
        rays, step_count = after, step_count + len(number)
    return Marched(marching.volume.brightness * light, np.minimum.accumulate(passing), step_count)


def _start_rays(marching: Marching, sky: Float[Array, "n 3"], steps: Float[Array, "n 3 2"]) -> _MarchedRays:
    """The rays at the camera."""
    directions = sky[None]
    if isinstance(marching.volume, SpotTraces) or marching.volume.grids:
        beside = sky + _APART * np.moveaxis(steps, -1, 0)
        directions = np.concatenate([directions, beside / np.linalg.norm(beside, axis=-1, keepdims=True)])
    with np.errstate(divide="ignore", invalid="ignore"):
        photon = photon_of(marching.camera.frame(), tuple(np.moveaxis(directions, -1, 0)))
        at_infinity = sky_redshift(marching.camera.frame(), sky)
        constants = np.stack([*potential_coefficients(marching.camera.spin, photon), photon.k, photon.b])
    place, rate = (np.stack(np.broadcast_arrays(*part)) for part in (photon.position, photon.rate))
    # The start of a ray in the plane is no crossing.
    side = np.sign(np.where(np.abs(place[3, 0]) < _IN_PLANE, rate[3, 0], place[3, 0]))
    psi, crossed, delay = np.zeros(directions.shape[:2]), np.zeros(len(sky), int), np.zeros(len(sky))
    return _MarchedRays(constants, at_infinity, place, rate, psi, side, crossed, delay)


def _is_running(marching: Marching, rays: _MarchedRays) -> Bool[Array, " n"]:
    """True for rays that may still reach the volume or continue in it."""
    u, rate = rays.place[0, 0], rays.rate[0, 0]
    gone = (rate <= 0) & (u <= min(_NO_RETURN, (1 - 1e-12) / marching.volume.outer))
    return ~gone & (u < (1 - _ABOVE_HORIZON) / kerr.horizon(marching.camera.spin))


def _step(marching: Marching, rays: _MarchedRays, width: Float[Array, " n"]) -> Float[Array, " n"]:
    """The next step (n,) in Mino time: a part of the scale and a small arc, cut at rims and crossings."""
    a2, a1, a0, k, _ = rays.constants[:, 0]
    u, rate = rays.place[0, 0], rays.rate[0, 0]
    pace = np.sqrt(np.maximum(k, 0) + 3 + 3 * a1 * u)
    # Mino time of a length as in flat space: the length / r^2.
    length = marching.step * marching.volume.length(1 / u, width) * u * u
    length = np.minimum(length, marching.step * _ARC_WITHIN / pace)
    length = np.minimum(length, marching.step * _CHANGE_WITHIN * u / np.maximum(np.abs(rate), 1e-300))
    inside = (u > (1 - 1e-9) / marching.volume.outer) & (u < (1 + 1e-9) / marching.volume.inner)
    outside = _ARC / pace
    if isinstance(marching.volume, SpotTraces):
        # The travel time needs small relative changes of the radius.
        outside = np.minimum(outside, _CHANGE_WITHIN * u / np.maximum(np.abs(rate), 1e-300))
    usual = np.where(inside, np.minimum(length, _ARC / pace), outside)
    pull = (a2 + (1.5 * a1 + 2 * a0 * u) * u) * u
    wall = 1 / kerr.horizon(marching.camera.spin)
    nearest = np.minimum(usual, _ARC * wall / np.maximum(np.abs(rate), 1e-300))
    for radius in (marching.volume.outer, marching.volume.inner):
        nearest = np.minimum(nearest, _arrival(u - 1 / radius, rate, pull))
    if marching.crossings:
        z, spin = rays.place[3, 0], marching.camera.spin
        nearest = np.minimum(nearest, _arrival(z, rays.rate[3, 0], (spin**2 - k - 2 * (spin * z) ** 2) * z))
    return np.maximum(nearest, _LEAST_STEP * usual)


def _arrival(gap: Array, rate: Array, pull: Array) -> Array:
    """The first time (n,) t > 0 at which gap + rate t + pull t^2 / 2 is 0; inf without one."""
    root = rate * rate - 2 * pull * gap
    with np.errstate(divide="ignore", invalid="ignore"):
        far = -(rate + np.copysign(np.sqrt(root), rate))
        times = np.stack([far / pull, 2 * gap / far])
    return np.where(times > 1e-13, times, np.inf).min(axis=0, initial=np.inf, where=np.isfinite(times))


def _rates(spin: float, constants: Array, place: Array) -> tuple[Array, Array]:
    """Second derivatives (4, ...) of u and m, and the first derivative of psi."""
    a2, a1, a0, k, b = constants
    u, _, _, z = place
    across = -(k + 2 * spin**2 * z * z) * place[1:]
    across[2] += spin**2 * z
    pull = (a2 + (1.5 * a1 + 2 * a0 * u) * u) * u
    return np.concatenate([pull[None], across]), -spin * u * (2 - spin * b * u) / (1 - 2 * u + (spin * u) ** 2)


def _advanced(spin: float, rays: _MarchedRays, h: Float[Array, " n"]) -> _MarchedRays:
    """Rays a step (n,) later: Nystroem's method of order 4."""
    place, rate = rays.place, rays.rate
    first, turn = _rates(spin, rays.constants, place)
    middle, turn_within = _rates(spin, rays.constants, place + h / 2 * (rate + h / 4 * first))
    last, turn_after = _rates(spin, rays.constants, place + h * (rate + h / 2 * middle))
    end = place + h * (rate + h / 6 * (first + 2 * middle))
    crosses = end[3, 0] * rays.side < 0
    return rays._replace(
        place=end,
        rate=rate + h / 6 * (first + 4 * middle + last),
        psi=rays.psi + h / 6 * (turn + 4 * turn_within + turn_after),
        side=np.where(crosses, -rays.side, rays.side),
        crossed=rays.crossed + crosses,
    )


class _VolumeSteps(NamedTuple):
    """Steps of n rays within the volume.

    half: (n,) half of the step, Mino time.
    side, crossed: (n,) as of the rays at the start.
    b: (n,) impact parameters.
    at_infinity: (n,) nu_camera / nu_infinity.
    places: radii, thetas and azimuths (n,) at both of Gauss's places in the step.
    """

    half: Array
    side: Array
    crossed: Array
    b: Array
    at_infinity: Array
    places: tuple[tuple[Array, Array, Array], ...]


def _steps_within(spin: float, before: _MarchedRays, after: _MarchedRays, h: Float[Array, " n"]) -> _VolumeSteps:
    """Radius, theta and azimuth at Gauss's places of a step: cubics between its ends."""
    places = []
    start, end = ((rays.place[:, 0], h * rays.rate[:, 0], rays.psi[0]) for rays in (before, after))
    turns = [h * _rates(spin, rays.constants[:, 0], rays.place[:, 0])[1] for rays in (before, after)]
    for s in _GAUSS:
        end_share = s * s * (3 - 2 * s)
        start_share, leaving, arriving = 1 - end_share, s * (1 - s) ** 2, s * s * (s - 1)
        u, x, y, z = start_share * start[0] + end_share * end[0] + leaving * start[1] + arriving * end[1]
        psi = start_share * start[2] + end_share * end[2] + leaving * turns[0] + arriving * turns[1]
        places.append((1 / u, np.arctan2(np.hypot(x, y), z), np.arctan2(y, x) + psi))
    return _VolumeSteps(h / 2, before.side, before.crossed, before.constants[4, 0], before.at_infinity, tuple(places))


def _add_step(
    marching: Marching, steps: _VolumeSteps, width: Array, number: Array, sums: tuple[Array, Array, Array]
) -> None:
    """Add the light of a step to the rays with some numbers, and apply its absorption.

    sums: light and transmission by crossings, and the transmission of everything so far.
    """
    assert isinstance(marching.volume, Volume)
    spin = marching.camera.spin
    light, passing_up_to, transmission = sums
    for radius, theta, azimuth in steps.places:
        density, temperature = marching.volume.matter(radius, theta, azimuth, width)
        energy = marching.volume.energy(spin, steps.b, radius, theta)
        shines = np.flatnonzero((density > 0) & np.isfinite(energy))
        if not len(shines):
            continue
        energy, which, hot = energy[shines], number[shines], temperature[shines]
        # Matter measures the length -p.u d(lambda), and d(lambda) = Sigma d(tau).
        sigma = radius[shines] ** 2 + (spin * np.cos(theta[shines])) ** 2
        passing = np.exp(-density[shines] * energy * sigma * steps.half[shines])
        ratio = steps.at_infinity[shines] / energy
        glow = seen_black_body(hot, ratio, marching.beaming, marching.colour_shift, marching.volume.response)
        glow = glow * marching.volume.tint(radius[shines], theta[shines], azimuth[shines], width[shines])
        # The side of the plane is that of each place: a step may end slightly beyond the plane.
        beyond = (np.cos(theta) * steps.side < 0)[shines]
        layer = np.minimum(steps.crossed[shines] + beyond, marching.crossings)
        light[layer, which] += (transmission[which] * (1 - passing))[:, None] * glow
        transmission[which] *= passing
        passing_up_to[layer, which] = transmission[which]


def _ray_part(spin: float, rays: tuple[_MarchedRays, _MarchedRays, Array], s: Array) -> RayPart:
    """Places in a step, at parts s (n,) of it: cubics between its ends."""
    before, after, h = rays
    start, end = ((part.place[:, 0], h * part.rate[:, 0], part.psi[0], part.delay) for part in (before, after))
    turns = [h * _rates(spin, part.constants[:, 0], part.place[:, 0])[1] for part in (before, after)]
    end_share = s * s * (3 - 2 * s)
    start_share, leaving, arriving, swell = 1 - end_share, s * (1 - s) ** 2, s * s * (s - 1), 6 * s * (1 - s)
    u, *m = start_share * start[0] + end_share * end[0] + leaving * start[1] + arriving * end[1]
    slope = swell * (end[0] - start[0]) + (1 - s) * (1 - 3 * s) * start[1] + s * (3 * s - 2) * end[1]
    psi = start_share * start[2] + end_share * end[2] + leaving * turns[0] + arriving * turns[1]
    vectors = [_about_axis(part, psi) for part in (m, slope[1:] / h)]
    return RayPart(u, vectors[0], slope[0] / h, vectors[1], start[3] + s * (end[3] - start[3]))


def _about_axis(vector: Any, psi: Array) -> Float[Array, "n 3"]:
    x, y, z = vector
    c, s = np.cos(psi), np.sin(psi)
    return np.stack([x * c - y * s, x * s + y * c, z], axis=-1)


def _time_between(spin: float, before: _MarchedRays, after: _MarchedRays, h: Array) -> Float[Array, " n"]:
    """Coordinate time (n,) of a step, negative as rays run backward.

    The part of flat space is exact, as t + u' / u is constant there; the remainder is by Simpson's rule.
    """
    ends = [(part.constants[:, 0], part.place[:, 0], part.rate[:, 0]) for part in (before, after)]
    constants, (first, last) = ends[0][0], (end[1] for end in ends)
    slopes = [h * end[2] for end in ends]
    middle = (first + last) / 2 + (slopes[0] - slopes[1]) / 8
    rate = (1.5 * (last - first) - (slopes[0] + slopes[1]) / 4) / h
    places = (first, ends[0][2]), (middle, rate), (last, ends[1][2])
    rates = [_time_rate(spin, constants, *place) for place in places]
    flat = ends[1][2][0] / last[0] - ends[0][2][0] / first[0]
    return flat - h / 6 * (rates[0] + 4 * rates[1] + rates[2])


def _time_rate(spin: float, constants: Array, place: Array, rate: Array) -> Float[Array, " n"]:
    """dt / dMino (n,) of light, and the derivative of u' / u."""
    (u, _, _, z), b = place, constants[4]
    pull = _rates(spin, constants, place)[0][0]
    square = 1 / u**2 + spin**2
    whole = spin * (b - spin * (1 - z * z)) + square * (square - spin * b) / (square - 2 / u)
    return whole + pull / u - (rate[0] / u) ** 2


def _add_spots(
    marching: Marching, rays: tuple[_MarchedRays, _MarchedRays, Array], width: Array, number: Array, light: Array
) -> None:
    """Add the light of spots in a step to the rays with some numbers."""
    assert isinstance(marching.volume, SpotTraces)
    before, after, h = rays

    def part_at(which: Array, s: Array) -> RayPart:
        return _ray_part(marching.camera.spin, (before.part(which), after.part(which), h[which]), s)

    spot_light = marching.volume.shine(part_at, h, width)
    ratio = before.at_infinity[spot_light.ray] / spot_light.energy
    glow = seen_black_body(
        spot_light.temperature, ratio, marching.beaming, marching.colour_shift, marching.volume.spots.response
    )
    ray = spot_light.ray
    layer = np.minimum(before.crossed[ray] + (spot_light.cosine * before.side[ray] < 0), marching.crossings)
    np.add.at(light, (layer, number[ray]), spot_light.light[:, None] * glow)


def _width(marching: Marching, rays: _MarchedRays) -> Float[Array, " n"]:
    """The larger diameter (n,) of a pixel's beam across the ray, M; 0 without neighbours.

    Lengths are those of flat space, which is enough to choose the level of a grid.
    """
    if len(rays.psi) == 1:
        return np.zeros(rays.psi.shape[1])
    place = _position(marching.camera.spin, rays.place, rays.psi)
    ahead = _position(marching.camera.spin, rays.place[:, :1] + 1e-6 * rays.rate[:, :1], rays.psi[:1]) - place[:, :1]
    ahead = ahead / np.linalg.norm(ahead, axis=0)
    beside = (place[:, 1:] - place[:, :1]) / _APART
    beside = beside - (beside * ahead).sum(axis=0) * ahead
    (xx, yy), xy = (beside**2).sum(axis=0), (beside[:, 0] * beside[:, 1]).sum(axis=0)
    return np.sqrt((xx + yy) / 2 + np.hypot((xx - yy) / 2, xy))


def _position(spin: float, place: Array, psi: Array) -> Float[Array, "3 m n"]:
    """Cartesian Boyer-Lindquist coordinates."""
    u, x, y, z = place
    across = np.hypot(1 / u, spin)
    c, s = np.cos(psi), np.sin(psi)
    return np.stack([across * (x * c - y * s), across * (x * s + y * c), z / u])
