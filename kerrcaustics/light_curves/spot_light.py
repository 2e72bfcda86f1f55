"""The light of a spot along the image of its orbit at one crossing of the plane.

The image is one closed curve, which is followed on the search sky, on which the hole is never small. Its points are
joined by splines over the edge phase; along them the light that arrives at a time is an integral (light_curves.py).
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from kerrcaustics.images.circle_arcs import Arcs
from kerrcaustics.lens_map.lens_map import LensMap
from kerrcaustics.lens_map.measured_light import redshift_slope
from kerrcaustics.numerics.splines import Spline
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.shadow import even_phases

Array = np.ndarray

# Pieces of a curve between its points, for integrals.
_PIECES = 16
# Half width of the spot's profile that is integrated, in standard deviations.
_DEVIATIONS = 7
# Longest distance of two points of an image in phase, radians.
_LONGEST = 0.03
# Most lines across the image of an orbit; most rounds of division.
_MOST_LINES = 20_000
_ROUNDS = 6


class CirclingSpot(NamedTuple):
    """A spot on a circular orbit: its angular velocity in coordinate time, and the power of g by which it shines."""

    radius: float
    size: float
    motion: str
    orbital: float
    power: float

    @property
    def period(self) -> float:
        """The period of the orbit."""
        return 2 * math.pi / abs(self.orbital)


@dataclass(frozen=True)
class OrbitImage(Rows):
    """Points of the image of an orbit, in the order of the edge phase.

    edge_phase: parameter of the curve, radians.
    search_sky: direction N on the search sky.
    sky: place on the viewer's sky.
    azimuth: of the point of the orbit, radians.
    travel_time: travel time, GM/c^3.
    travel_time_error: its error.
    redshift: frequency ratio g.
    light: g^power times solid angle, for a unit of radius and a radian along the curve on the search sky.
    light_error: error of g^power, relative to it.
    """

    edge_phase: Float[Array, " points"]
    search_sky: Float[Array, "points 3"]
    sky: Float[Array, "points axes"]
    azimuth: Float[Array, " points"]
    travel_time: Float[Array, " points"]
    travel_time_error: Float[Array, " points"]
    redshift: Float[Array, " points"]
    light: Float[Array, " points"]
    light_error: Float[Array, " points"]


class SplinedCurve(NamedTuple):
    """An image of the orbit as smooth functions of the edge phase.

    sky: Place on the viewer's sky.
    azimuth: Azimuth phi less the secular growth, radians.
    phase: phi + Omega T less the secular growth, radians.
    redshift: Frequency ratio g.
    light: Light along the curve.
    winds: Secular growth of both angles, turns per turn of the edge phase.
    """

    sky: Spline
    azimuth: Spline
    phase: Spline
    redshift: Spline
    light: Spline
    winds: int


def orbit_image(lens_map: LensMap, arcs: Arcs, spot: CirclingSpot, points: int) -> OrbitImage | None:
    """The image of an orbit, at points between which its phase changes little; None if some were not found."""
    image = _points(lens_map, arcs, spot, even_phases(lens_map.viewer, np.arange(points) / points))
    for _ in range(_ROUNDS):
        if image is None:
            return None
        parts = _parts(image, spot.orbital)
        if parts.max() == 1 or parts.sum() > _MOST_LINES:
            break
        width = np.diff(image.edge_phase, append=image.edge_phase[0] + 2 * math.pi)
        between = [t + w * np.arange(1, n) / n for t, w, n in zip(image.edge_phase, width, parts, strict=True)]
        more = _points(lens_map, arcs, spot, np.concatenate(between))
        image = None if more is None else image.joined(more)
        image = None if image is None else image[np.argsort(image.edge_phase)]
    return None if image is None else replace(image, azimuth=np.unwrap(image.azimuth))


def _points(
    lens_map: LensMap, arcs: Arcs, spot: CirclingSpot, edge_phase: Float[Array, " points"]
) -> OrbitImage | None:
    points = arcs.points_at(edge_phase)
    if not (points.index >= 0).all():
        return None
    light = lens_map.light_at(points.sky)
    solid_angle = lens_map.sky.lengths(points.sky) ** 2 / (spot.radius * points.gradient)
    bright = light.redshift**spot.power * solid_angle
    times = light.time, light.time_error
    off = np.abs(np.log(light.beams.radius / spot.radius)) + light.beams.error + points.miss(spot.radius)
    doubt = spot.power * off * redshift_slope(lens_map, spot.motion, points.sky, points.radius)
    return OrbitImage(edge_phase, points.sky, light.sky, light.azimuth, *times, light.redshift, bright, np.abs(doubt))


def _parts(image: OrbitImage, orbital: float) -> Int[Array, " points"]:
    """The number of parts into which each step between neighbouring points must be divided."""
    phase = image.azimuth + orbital * image.travel_time
    change = np.diff(phase, append=phase[0])
    change -= 2 * math.pi * np.round(change / (2 * math.pi))
    return np.clip(np.ceil(np.abs(change) / _LONGEST), 1, 8).astype(int)


def splined_curve(image: OrbitImage, spot: CirclingSpot, step: int) -> SplinedCurve:
    """An image of the orbit by every so many of its points."""
    gained = image.azimuth[-1] - image.azimuth[0]
    winds = round((gained + np.angle(np.exp(1j * (image.azimuth[0] - image.azimuth[-1])))) / (2 * math.pi))
    part = image[::step]
    closed = np.append(part.edge_phase, part.edge_phase[0] + 2 * math.pi)

    def spline(values: Array) -> Spline:
        return Spline(closed, np.concatenate([values, values[:1]]), periodic=True)

    azimuth = part.azimuth - winds * part.edge_phase
    along = np.linalg.norm(spline(part.search_sky)(part.edge_phase, 1), axis=-1)
    phase = spline(azimuth + spot.orbital * part.travel_time)
    return SplinedCurve(
        spline(part.sky), spline(azimuth), phase, spline(part.redshift), spline(part.light * along), winds
    )


def received_light(ring: SplinedCurve, orbital: float, time: Array, deviation: float) -> Float[Array, "times columns"]:
    """Light at some times of a spot with a Gaussian profile of unit area in azimuth; the same times the place, T and g.

    The curve is a chain of short pieces on which the phase is linear and the light is the same: each is integrated
    exactly, however long it is compared with the spot.
    """
    # Imported here as light curves of points do not need SciPy's functions.
    from scipy.special import ndtr

    knots = ring.phase.x
    edge_phase = np.append(
        (knots[:-1, None] + np.diff(knots)[:, None] * np.arange(_PIECES) / _PIECES).ravel(), knots[-1]
    )
    phase = ring.phase(edge_phase) + ring.winds * edge_phase
    inside = (edge_phase[1:] + edge_phase[:-1]) / 2
    travel_time = (ring.phase(inside) - ring.azimuth(inside)) / orbital
    light = (ring.light(inside) * np.diff(edge_phase))[:, None] * np.column_stack(
        [np.ones_like(travel_time), ring.sky(inside), travel_time, ring.redshift(inside)]
    )
    middle, half = (phase[1:] + phase[:-1]) / 2, np.maximum(np.abs(np.diff(phase)) / 2, 1e-6 * deviation)
    order = np.argsort(np.mod(middle, 2 * math.pi))
    place = (np.mod(middle, 2 * math.pi)[order] + 2 * math.pi * np.arange(-1, 2)[:, None]).ravel()
    reach = min(half.max() + _DEVIATIONS * deviation, math.pi)
    total = np.zeros((len(time), light.shape[1]))
    for i, now in enumerate(np.mod(orbital * time, 2 * math.pi)):
        first, last = np.searchsorted(place, (now - reach, now + reach))
        near = order[np.arange(first, last) % len(order)]
        low, high = ((place[first:last] - now + side * half[near]) / deviation for side in (-1, 1))
        total[i] = ((ndtr(high) - ndtr(low)) / (2 * half[near])) @ light[near]
    return total
