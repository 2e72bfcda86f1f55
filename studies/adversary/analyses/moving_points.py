"""Images of points in free fall, many of them on unstable orbits, by integrated rays to where the point truly was."""

import math

import numpy as np

import kerrcaustics as kc
from kerrcaustics.light_curves.results import LightCurve
from kerrcaustics.spacetime.viewer import Viewer

from ..true_orbits import Release, true_fall
from ..unstable_orbits import releases
from .claim import Claim, Kind
from .hard_viewers import Random, hard_inclination, one_of, power

Array = np.ndarray

# Images that are compared, each with a place in long arithmetic of so many digits; the latest emission.
_MOST, _DIGITS, _LATEST = 5, 30, 300.0
# Relative uncertainty of a place beyond which nothing is claimed.
_UNKNOWN = 0.1


def moving_point_claims(rng: Random) -> list[Claim]:
    """Where each image lies: the ray there meets the sphere on which the point was, at the place where it was then."""
    source = releases(int(rng.integers(1 << 30)))
    release, late = next(one for one in source if abs(one[1]) < _LATEST)
    viewer = _viewer(release.spin, rng)
    delay = 0.0 if isinstance(viewer, kc.Observer) else viewer.radius
    times = (late + delay + rng.uniform(-10, 40, 3)).tolist()
    orbit, index = kc.Orbit.geodesic(release.radius, release.theta, velocity=release.velocity), int(rng.integers(0, 3))
    light = kc.light_curve(viewer, orbit, times, max_index=index)
    code = f"kc.light_curve({viewer!r}, kc.Orbit.{orbit.words}, {times!r}, max_index={index})"
    images = np.argwhere(np.isfinite(light.emission_time) & np.isfinite(light.sky_error))
    claims = []
    for image, moment in rng.permutation(images)[:_MOST]:
        claims += _image_claims(light, release, (int(image), int(moment)), code)
    return claims


def _viewer(spin: float, rng: Random) -> Viewer:
    inclination = hard_inclination(rng, -6.0)
    if rng.uniform() < 0.3:
        return kc.Observer(spin=spin, inclination=inclination)
    return kc.Camera(spin, one_of(rng, 2.5 + power(rng, -1, 1), power(rng, 1, 3)), inclination, "fiducial")


def _image_claims(light: LightCurve, release: Release, at: tuple[int, int], code: str) -> list[Claim]:
    """Place and time of an image at a moment."""
    emitted, late = float(light.emission_time[at]), float(light.emission_time_error[at])
    true = true_fall(release, emitted, _DIGITS)
    if true is None:
        return []
    radius, theta, phi = (float(part) for part in true)
    place = np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])
    sphere, sky = kc.Sphere(radius), light.sky[at][None]
    found = [_arrival(light, end, sky, place, at) for end in (sphere, sphere.at_second_arrival())]
    found = [one for one in found if one is not None]
    words = f"{code}.sky[{at[0]}, {at[1]}]"
    if not found:
        return []
    # What moves slower than light moves less than that by angle.
    moved = late * 2 / radius
    miss, spread, gone, unsure = min(found, key=lambda one: one[0] - one[1])
    if spread + moved > _UNKNOWN:
        return []
    return [
        Claim("place", miss / (spread + moved), words),
        Claim("time", abs(gone) / (late + unsure), words.replace(".sky", ".emission_time")),
    ]


def _arrival(
    light: LightCurve, end: kc.Sphere, sky: Array, place: Array, at: tuple[int, int]
) -> tuple[float, float, float, float] | None:
    """By how much the ray misses a place, and the time; each with what is allowed. None where it does not arrive."""
    beam = kc.trace_beams(light.camera, sky, "integrated", 1e-13, end=end, time=True, crossings=False, redshift=False)
    if not (np.isfinite(beam.error[0]) and beam.time is not None and beam.time_error is not None):
        return None
    miss = float(np.linalg.norm(beam.direction[0] - place))
    stretch = float(light.sky_error[at]) * float(np.linalg.norm(beam.jacobian[0], 2))
    gone = float(light.time[at[1]] - beam.time[0] - light.emission_time[at])
    return miss, stretch + float(beam.error[0]), gone, float(beam.time_error[0])


KINDS: dict[str, Kind] = {"moving points": moving_point_claims}
