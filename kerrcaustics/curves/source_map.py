"""The map from the camera sky to the sphere that sources lie on: the celestial one, or one of finite radius.

Its domain is covered by the lines of sky_lines.py. A ray that meets a sphere within the camera's radius falls on it,
and where it turns below, meets it a second time on its way out. So the domain has two leaves, joined along the rim
where rays only graze the sphere; a line runs down the first leaf from the direction of the hole to the rim, and
from there on the second one to the shadow edge, and its depth grows smoothly all the way. Where the sphere lies within
all photon orbits there is no rim: lines come to the shadow edge from inside.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import TypeVar

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline
from scipy.optimize import elementwise

from kerrcaustics.beams.beam import Beams, Rays
from kerrcaustics.beams.ends import CelestialSphere, Sphere, Spherical, end_of
from kerrcaustics.beams.trace import trace_in_steps, trace_rays
from kerrcaustics.curves import sky_lines
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.arrays import HostVectors
from kerrcaustics.spacetime.camera import Camera, check_camera, photon, sky_from_fido
from kerrcaustics.spacetime.checks import quoted
from kerrcaustics.spacetime.observer import straight_ahead
from kerrcaustics.spacetime.shadow import edge_photons

Array = np.ndarray
Kind = TypeVar("Kind", bound=Rays)

# Points of the rim that are found; a spline joins them.
_TABLE = 2048
# How far below the horizontal a line begins where the sphere has the camera's own radius, radians.
_BELOW = 1e-9
# Rays with an impact parameter of so many radii of a sphere that is outside all photon orbits miss it.
_FAR = 40.0


@dataclass(frozen=True)
class SourceMap:
    """camera: at rest at the event; end: the sphere, as a first arrival."""

    camera: Camera
    end: Spherical

    @property
    def inside(self) -> bool:
        """True where the sphere lies within the camera's radius."""
        return isinstance(self.end, Sphere) and self.end.radius < self.camera.radius

    @property
    def level(self) -> bool:
        """True where the sphere has the camera's radius: only rays that leave inward come back to it."""
        return isinstance(self.end, Sphere) and self.end.radius == self.camera.radius

    @property
    def zoom(self) -> float:
        """How much smaller the sky is on which lines run evenly, 1 or less.

        On an observer's screen lines run as on the sky of a camera where the sources are.
        """
        frame, nearest = self.camera.frame(), min(float(self.end.radius), self.camera.radius)
        if not self.camera.is_distant or math.isinf(nearest):
            return 1.0
        return min(1.0, frame.zoom * frame.radius / nearest)

    @property
    def sunk(self) -> float:
        """By how much depths are larger than they would be on the sky itself, about."""
        return -math.log(self.zoom)

    @property
    def unbounded(self) -> bool:
        """True for an observer at infinity and the celestial sphere: what is seen directly is infinitely far out.

        Rays at infinite (alpha, beta) all lead to the point opposite to the observer: the primary caustic.
        """
        return math.isinf(self.camera.radius) and isinstance(self.end, CelestialSphere)

    def first(self, turn: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Depth at which lines begin."""
        if self.unbounded:
            away = math.acos(1 - straight_ahead(self.camera))
            return -np.log1p(-away / sky_lines.line_reach(self.camera, turn))
        if not self.level:
            return np.zeros_like(turn)
        reach = sky_lines.wide_reach(self.camera, turn, self.zoom)
        return -np.log((reach - np.pi / 2 - _BELOW) / reach)

    def looking(
        self, turn: Float[Array, "*batch"], depth: Float[Array, "*batch"]
    ) -> tuple[HostVectors, Bool[Array, "*batch"]]:
        """Looking directions (..., 3), and whether they stand for the second leaf."""
        if not self.inside:
            first = np.zeros(np.shape(depth), bool)
            if self.zoom == 1:
                return sky_lines.looking(self.camera, turn, depth), first
            reach = sky_lines.wide_reach(self.camera, turn, self.zoom)
            return self._beside(turn, reach * np.exp(-np.asarray(depth, float))), first
        assert isinstance(self.end, Sphere)
        size = np.pi - sky_lines.wide_reach(self.camera, turn, self.zoom)
        rim = _rim(self.camera, float(self.end.radius), self.zoom)
        if rim is None:
            return self._beside(turn, -size * np.exp(-depth)), np.zeros_like(depth, bool)
        width = rim(turn)
        # The two forms have one value and two derivatives in common at the rim.
        fold = np.sqrt(2 * (width + size) / width)
        away = depth - fold
        falling = width - (width + size) * (away / fold) ** 2
        # 1 / cosh, which has no overflow far down.
        part = np.exp(-np.maximum(away, 0))
        distance = np.where(away <= 0, falling, width * 2 * part / (1 + part * part))
        return self._beside(turn, distance), away > 0

    def _beside(self, turn: Float[Array, "*batch"], distance: Float[Array, "*batch"]) -> HostVectors:
        return sky_lines.on_wide_sky(self.camera, turn, distance, self.zoom)

    def beams(self, looking: Float[Array, "n 3"], returning: Bool[Array, " n"], engine: str, tolerance: float) -> Beams:
        """Beams with their index, as steps of one job."""
        sky = sky_from_fido(self.camera.frame(), -looking)

        def traced(sky: Array, end: Spherical) -> Beams:
            return trace_in_steps(self.camera, sky, engine, tolerance, end)

        return on_leaves(self.end, sky, returning, traced)

    def directions(self, looking: HostVectors, returning: Bool[Array, "*batch"], tolerance: float) -> HostVectors:
        """Unit vectors n' (..., 3)."""
        sky = sky_from_fido(self.camera.frame(), -looking).reshape(-1, 3)

        def traced(sky: Array, end: Spherical) -> Rays:
            return trace_rays(self.camera, sky, "auto", tolerance, end=end)

        rays = on_leaves(self.end, sky, returning.ravel(), traced)
        return rays.direction.reshape(looking.shape)


def on_leaves(
    end: Spherical, sky: Float[Array, "n 3"], returning: Bool[Array, " n"], traced: Callable[[Array, Spherical], Kind]
) -> Kind:
    """Rays, or beams, on both leaves, as `traced` gives them for directions N and an end."""
    if not returning.any():
        return traced(sky, end)
    assert isinstance(end, Sphere)
    second = traced(sky[returning], replace(end, returning=True))
    return second if returning.all() else _merged(traced(sky[~returning], end), second, returning)


def _merged(first: Kind, second: Kind, returning: Bool[Array, " n"]) -> Kind:
    """Rays of both leaves in one order."""

    def joined(one: object, other: object) -> object:
        if not isinstance(one, np.ndarray) or not isinstance(other, np.ndarray):
            return one
        both = np.empty((len(returning), *one.shape[1:]), one.dtype)
        both[~returning], both[returning] = one, other
        return both

    return replace(first, **{f.name: joined(getattr(first, f.name), getattr(second, f.name)) for f in fields(first)})


def spherical(camera: Camera, end: object, *, distant: bool = False) -> Spherical:
    """The sphere that `end=` means; what is none is refused with one ValueError. distant: as for `check_camera`."""
    check_camera(camera, distant=distant)
    found = end_of(camera, end)
    if not isinstance(found, Spherical):
        raise ValueError(f"Argument `end` must be a radius or math.inf, but is {quoted(end)}.")
    return found


def check_domain(camera: Camera, end: Spherical) -> None:
    """Refuse spheres that some rays reach and others only wind toward, with one ValueError."""
    if isinstance(end, CelestialSphere):
        return
    orbits = _edge_orbits(camera, np.linspace(0, 2 * np.pi, 721))
    low, high, horizon = float(orbits.min()), float(orbits.max()), kerr.horizon(camera.spin)
    if end.radius > high or (end.radius < low and end.radius < camera.radius):
        return
    below = f"in ({horizon:.6g}, {low:.6g}) or " if camera.radius > low else ""
    raise ValueError(
        f"Argument `end` must be {below}larger than {high:.6g} for this camera (between them lie photon orbits, and no "
        f"count is certain), but is {end.radius:.12g}."
    )


def _edge_orbits(camera: Camera, turn: Float[Array, " turns"]) -> Float[Array, " turns"]:
    """Radii of the photon orbits toward which the rays of the shadow edge wind."""
    frame = camera.frame()
    light = photon(frame, tuple(sky_from_fido(frame, edge_photons(camera, turn)).T))
    return np.asarray(kerr.spherical_orbit_of_impact(camera.spin, light.b)[0])


@lru_cache(maxsize=8)
def _rim(camera: Camera, radius: float, zoom: float) -> CubicSpline | None:
    """How far from the shadow edge rays only graze a sphere, by turn; None where all that meet it fall in.

    zoom: of the sky on which that is measured.
    """
    turn = 2 * np.pi * np.arange(_TABLE) / _TABLE
    if radius < _edge_orbits(camera, turn).min():
        return None
    frame, reach = camera.frame(), sky_lines.wide_reach(camera, turn, zoom)

    def potential(distance: Array, turn: Array) -> Array:
        sky = sky_from_fido(frame, -sky_lines.on_wide_sky(camera, turn, distance, zoom))
        light = photon(frame, tuple(np.moveaxis(sky, -1, 0)))
        square = radius**2 + camera.spin**2
        return (square - camera.spin * light.b) ** 2 - (square - 2 * radius) * light.kappa

    # Rays that leave horizontally, or pass far from the sphere.
    size = min(2 * camera.radius, _FAR * radius) if camera.is_distant else 2 * camera.radius
    beyond = 2 * math.atan(2 * frame.zoom * frame.radius / (zoom * size))
    found = elementwise.find_root(potential, (np.zeros(_TABLE), reach - beyond), args=(turn,))
    width = np.append(found.x, found.x[0])
    return CubicSpline(np.append(turn, 2 * np.pi), width, bc_type="periodic")
