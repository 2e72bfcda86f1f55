"""Magnifications of discs in hard places, against an adaptive sum over rays (extended_sources/twin.py)."""

import math

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.ends import End, EquatorialPlane, Sphere, end_of
from kerrcaustics.spacetime import kerr

from ...extended_sources.twin import summed
from .claim import Claim, Kind
from .hard_viewers import Random, hard_spin, one_of, power

# Errors of the twin that a difference may amount to, and a relative one.
_TWIN_ERRORS, _TWIN_LEAST = 4.0, 5e-4
# Relative error of the twin beyond which it says nothing.
_COARSE = 0.2


def disc_claims(rng: Random) -> list[Claim]:
    """The light of a disc, where it is certified."""
    kind = (_on_axis, _behind, _in_plane, _near_viewer)[int(rng.integers(4))]
    viewer, end, place, size = kind(rng)
    highest = int(rng.integers(0, 4))
    code = f"kc.magnification({viewer!r}, {place!r}, {size!r}, max_index={highest}, end={end!r})"
    seen = kc.magnification(viewer, place, size, max_index=highest, end=end)
    if not seen.certified:
        return []
    angle = size / end.radius if isinstance(end, Sphere) else size
    twin, off = summed(viewer, end.vectors(np.array([place]))[0], angle, highest, surface=end)
    if not off < _COARSE * twin:
        return []
    allowed = seen.error + _TWIN_ERRORS * off + _TWIN_LEAST * twin
    return [Claim("light", abs(seen.total - twin) / allowed, code)]


_Drawn = tuple[kc.Camera, End, tuple[float, float], float]


def _camera(rng: Random, inclination: float | None = None) -> kc.Camera:
    spin = min(hard_spin(rng), 1 - 1e-6)
    polar = one_of(rng, math.acos(rng.uniform(-1, 1)), math.pi / 2) if inclination is None else inclination
    return kc.Camera(spin, 2.1 + one_of(rng, power(rng, -1, 1), power(rng, 1, 3)), polar, "fiducial")


def _on_axis(rng: Random) -> _Drawn:
    """Camera or source, or both, on the axis or beside it."""
    beside = one_of(rng, 0.0, power(rng, -9, -2))
    camera = _camera(rng, beside if rng.uniform() < 0.6 else None)
    other = one_of(rng, 0.0, power(rng, -9, -1))
    place = one_of(rng, other, math.pi - other), float(rng.uniform(0, 2 * math.pi))
    return camera, end_of(camera, math.inf), place, power(rng, -4, 0.2)


def _behind(rng: Random) -> _Drawn:
    """Sources far from a far camera, within a few of their radii from the line through the hole, or at a far phase."""
    camera = _camera(rng)
    end = end_of(camera, one_of(rng, math.inf, camera.radius * power(rng, 0.1, 2)))
    size = power(rng, -5, 0)
    theta = float(np.clip(math.pi - camera.inclination + size * rng.normal(), 1e-6, math.pi - 1e-6))
    phi = one_of(rng, 0.0, math.pi) + size * rng.normal() + 2 * math.pi * int(rng.integers(-3, 4))
    return camera, end, (theta, float(phi)), size * (end.radius if isinstance(end, Sphere) else 1.0)


def _in_plane(rng: Random) -> _Drawn:
    """Discs in the plane next to the horizon, as large as they may be, and far."""
    camera = _camera(rng)
    horizon = kerr.horizon(camera.spin)
    radius = horizon * (1 + power(rng, -4, 0)) if rng.uniform() < 0.5 else horizon + power(rng, 0, 2)
    size = (radius - horizon) * one_of(rng, 0.98, power(rng, -3, -0.1))
    phase = float(rng.uniform(0, 2 * math.pi)) + 2 * math.pi * int(rng.integers(-3, 4))
    return camera, EquatorialPlane(int(rng.integers(1, 4))), (radius, phase), size


def _near_viewer(rng: Random) -> _Drawn:
    """Spheres that pass next to the camera."""
    camera = _camera(rng)
    end = end_of(camera, camera.radius * (1 + float(rng.choice([-1, 1])) * power(rng, -3, -0.3)))
    place = math.acos(rng.uniform(-1, 1)), float(rng.uniform(0, 2 * math.pi))
    return camera, end, place, power(rng, -3, 0) * camera.radius


KINDS: dict[str, Kind] = {"discs": disc_claims}
