"""Errors by caustics beside a star, on the side where they have no images."""

import math

import numpy as np

from kerrcaustics.curves.critical_points import Points
from kerrcaustics.curves.winding import distance_from_sides
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.sphere import lengths
from kerrcaustics.waves.ring_integral import NearestCurve
from kerrcaustics.waves.wave_images import WaveImages

Array = np.ndarray

# Decay rate of waves beyond a fold, per frequency and distance^(3/2), for the impact parameters of photon orbits.
_DECAY = 10 / 3
# Field on a fold = this x amplitude of the images beside it x omega^(1/6).
_BESIDE_FOLD = 1.6
# Error of an image beside a cusp = this x its amplitude / its phase to the images that it would meet.
_BESIDE_CUSP = 0.4
# Largest distance in position angle, radians, of images from the part of a caustic that they belong to.
_BESIDE_IMAGES = 0.3
# Distance from a caustic, in its sizes, beyond which it counts as small.
_SMALL = 3.0


def error_beyond_caustic(
    caustic: Points,
    star: Float[Array, " 3"],
    ring: WaveImages,
    omega: Float[Array, " frequencies"],
    around: Float[Array, " images"] | None = None,
    reach: float | None = None,
) -> Float[Array, " frequencies"]:
    """The error by a caustic beside the star, on the side without images.

    Beyond a fold waves fall as the Airy function does; on a fold they grow with the sixth root of the frequency. The
    error of the image beside a cusp falls with the phase between it and the images that meet it on the cusp. There is
    no such error by a caustic much smaller than its distance, by the part that belongs to the images at the position
    angles `around`, or by the stretch next to the star if its images are continued over `reach`.
    """
    away = _distances(caustic, star)
    if away.min() > _SMALL * float(lengths(caustic.direction - caustic.direction.mean(axis=0)).max()):
        return np.zeros(len(omega))
    if around is not None:
        line = caustic.line_of_sight
        turn = np.exp(1j * np.arctan2(line[:, 2], line[:, 1]))
        middle = np.exp(1j * around).mean()
        spread = float(np.abs(np.angle(np.exp(1j * around) / middle)).max())
        away = away[np.abs(np.angle(turn / middle)) > spread + _BESIDE_IMAGES]
    if reach is not None:
        away = away[~_beside_star(caustic, star, reach)]
    return _error_beyond_fold(ring, float(away.min(initial=np.inf)), omega)


def error_beyond_gap(
    ring: WaveImages,
    curve: NearestCurve,
    caustic: Points | None,
    star: Float[Array, " 3"],
    omega: Float[Array, " frequencies"],
) -> Float[Array, " frequencies"]:
    """The error by the part of a caustic that the gap of a nearest curve hides."""
    if caustic is None or curve.gap is None:
        return np.zeros(len(omega))
    away = _distances(caustic, star)[curve.gap.hides(caustic.edge_phase)]
    return _error_beyond_fold(ring, float(away.min(initial=np.inf)), omega)


def nearest_is_hidden(curve: NearestCurve, caustic: Points, star: Float[Array, " 3"]) -> bool:
    """True if the gap of a nearest curve hides the point of the caustic that is nearest to the star."""
    nearest = lengths(caustic.direction - star).argmin()
    hidden: Bool[Array, " 1"] = (
        np.zeros(1, bool) if curve.gap is None else curve.gap.hides(caustic.edge_phase[[nearest]])
    )
    return bool(hidden[0])


def _beside_star(caustic: Points, star: Float[Array, " 3"], reach: float) -> Bool[Array, " points"]:
    """True for the stretch of a caustic on both sides of its nearest point, as far as the distance grows.

    Within the reach it need not grow: at a cusp it does not.
    """
    away = lengths(caustic.direction - star)
    start, count = int(away.argmin()), len(away)
    beside = np.zeros(count, bool)
    for turn in (1, -1):
        ahead = away[(start + turn * np.arange(count + 1)) % count]
        nearer = np.flatnonzero((np.diff(ahead) < 0) & (ahead[1:] > reach))
        last = int(nearer[0]) if len(nearer) else count
        beside[(start + turn * np.arange(last + 1)) % count] = True
    return beside


def _distances(caustic: Points, star: Float[Array, " 3"]) -> Float[Array, " points"]:
    """Distances of a star from the sides between points of a caustic, each with the next."""
    place = caustic.direction
    return distance_from_sides(place, np.roll(place, -1, axis=0), np.broadcast_to(star, place.shape))


def _two_indices(ring: WaveImages) -> tuple[int, int]:
    """The lowest and the highest index of images of a ring."""
    return int(ring.index.min()), int(ring.index.max())


def _error_beyond_fold(
    ring: WaveImages, nearest: float, omega: Float[Array, " frequencies"]
) -> Float[Array, " frequencies"]:
    """The error by a caustic at a distance from the star, on its side without images."""
    if not len(ring):
        return np.zeros(len(omega))
    # Next to a fold the amplitudes of its pair diverge; those of the other images give the brightness of the ring, as
    # images that meet are equally bright.
    clipped = np.minimum(ring.amplitude, max(1.0, float(ring.amplitude.min())))
    bright = math.sqrt(math.prod(np.linalg.norm(clipped[ring.index == n]) for n in _two_indices(ring)))
    phase = _DECAY * omega * nearest**1.5
    with np.errstate(divide="ignore"):
        on_fold = _BESIDE_FOLD * np.maximum(omega, 1.0) ** (1 / 6) * bright
        return np.minimum(on_fold * np.exp(-phase) + _BESIDE_CUSP / phase * bright, on_fold)
