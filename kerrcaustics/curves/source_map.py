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
from kerrcaustics.beams.ends import CelestialSphere, End, Sphere, Spherical, end_of
from kerrcaustics.beams.trace import trace_in_steps, trace_rays
from kerrcaustics.curves import sky_lines
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.arrays import HostVectors
from kerrcaustics.spacetime.checks import quoted
from kerrcaustics.spacetime.frame import photon_of, sky_from_fido
from kerrcaustics.spacetime.shadow import edge_photons
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

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

    camera: Viewer
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
        if math.isinf(nearest):
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

    def first(self, edge_phase: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Depth at which lines begin."""
        if self.unbounded:
            away = math.acos(1 - self.camera.straight_ahead)
            return -np.log1p(-away / sky_lines.line_reach(self.camera, edge_phase))
        if not self.level:
            return np.zeros_like(edge_phase)
        reach = sky_lines.wide_reach(self.camera, edge_phase, self.zoom)
        return -np.log((reach - np.pi / 2 - _BELOW) / reach)

    def line_of_sight(
        self, edge_phase: Float[Array, "*batch"], depth: Float[Array, "*batch"]
    ) -> tuple[HostVectors, Bool[Array, "*batch"]]:
        """Lines of sight (..., 3), and whether they stand for the second leaf."""
        if not self.inside:
            first = np.zeros(np.shape(depth), bool)
            if self.zoom == 1:
                return sky_lines.line_of_sight(self.camera, edge_phase, depth), first
            reach = sky_lines.wide_reach(self.camera, edge_phase, self.zoom)
            return self._beside(edge_phase, reach * np.exp(-np.asarray(depth, float))), first
        assert isinstance(self.end, Sphere)
        size = np.pi - sky_lines.wide_reach(self.camera, edge_phase, self.zoom)
        rim = _rim(self.camera, float(self.end.radius), self.zoom)
        if rim is None:
            return self._beside(edge_phase, -size * np.exp(-depth)), np.zeros_like(depth, bool)
        width = rim(edge_phase)
        # The two forms have one value and two derivatives in common at the rim.
        fold = np.sqrt(2 * (width + size) / width)
        away = depth - fold
        falling = width - (width + size) * (away / fold) ** 2
        # 1 / cosh, which has no overflow far down.
        part = np.exp(-np.maximum(away, 0))
        distance = np.where(away <= 0, falling, width * 2 * part / (1 + part * part))
        return self._beside(edge_phase, distance), away > 0

    def _beside(self, edge_phase: Float[Array, "*batch"], distance: Float[Array, "*batch"]) -> HostVectors:
        return sky_lines.on_wide_sky(self.camera, edge_phase, distance, self.zoom)

    def beams(
        self, line_of_sight: Float[Array, "n 3"], second_arrival: Bool[Array, " n"], engine: str, tolerance: float
    ) -> Beams:
        """Beams with their index, as steps of one job."""
        sky = sky_from_fido(self.camera.frame(), -line_of_sight)

        def traced(sky: Array, end: End) -> Beams:
            return trace_in_steps(self.camera, sky, engine, tolerance, end)

        return on_leaves(self.end, sky, second_arrival, traced)

    def directions(
        self, line_of_sight: HostVectors, second_arrival: Bool[Array, "*batch"], tolerance: float
    ) -> HostVectors:
        """Unit vectors n' (..., 3)."""
        sky = sky_from_fido(self.camera.frame(), -line_of_sight).reshape(-1, 3)

        def traced(sky: Array, end: End) -> Rays:
            return trace_rays(self.camera, sky, "auto", tolerance, end=end)

        rays = on_leaves(self.end, sky, second_arrival.ravel(), traced)
        return rays.direction.reshape(line_of_sight.shape)


def on_leaves(
    end: End,
    sky: Float[Array, "n 3"],
    second_arrival: Bool[Array, " n"] | None,
    traced: Callable[[Array, End], Kind],
) -> Kind:
    """Rays, or beams, on both leaves, as `traced` gives them for directions N and an end."""
    if second_arrival is None or not second_arrival.any():
        return traced(sky, end)
    second = traced(sky[second_arrival], end.at_second_arrival())
    return second if second_arrival.all() else _merged(traced(sky[~second_arrival], end), second, second_arrival)


def _merged(first: Kind, second: Kind, second_arrival: Bool[Array, " n"]) -> Kind:
    """Rays of both leaves in one order."""

    def joined(one: object, other: object) -> object:
        if not isinstance(one, np.ndarray) or not isinstance(other, np.ndarray):
            return one
        both = np.empty((len(second_arrival), *one.shape[1:]), one.dtype)
        both[~second_arrival], both[second_arrival] = one, other
        return both

    return replace(first, **{f.name: joined(getattr(first, f.name), getattr(second, f.name)) for f in fields(first)})


def spherical(camera: Viewer, end: object) -> Spherical:
    """The sphere that `end=` means; what is none is refused with one ValueError."""
    check_viewer(camera)
    found = end_of(camera, end)
    if not isinstance(found, Spherical):
        raise ValueError(f"Argument `end` must be a radius or math.inf, but is {quoted(end)}.")
    return found


def check_domain(camera: Viewer, end: Spherical) -> None:
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


def _edge_orbits(camera: Viewer, edge_phase: Float[Array, " edge_phases"]) -> Float[Array, " edge_phases"]:
    """Radii of the photon orbits toward which the rays of the shadow edge wind."""
    frame = camera.frame()
    photon = photon_of(frame, tuple(sky_from_fido(frame, edge_photons(camera, edge_phase)).T))
    return np.asarray(kerr.spherical_orbit_of_impact(camera.spin, photon.b)[0])


@lru_cache(maxsize=8)
def _rim(camera: Viewer, radius: float, zoom: float) -> CubicSpline | None:
    """How far from the shadow edge rays only graze a sphere, by edge phase; None where all that meet it fall in.

    zoom: of the sky on which that is measured.
    """
    edge_phase = 2 * np.pi * np.arange(_TABLE) / _TABLE
    if radius < _edge_orbits(camera, edge_phase).min():
        return None
    frame, reach = camera.frame(), sky_lines.wide_reach(camera, edge_phase, zoom)

    def potential(distance: Array, edge_phase: Array) -> Array:
        sky = sky_from_fido(frame, -sky_lines.on_wide_sky(camera, edge_phase, distance, zoom))
        photon = photon_of(frame, tuple(np.moveaxis(sky, -1, 0)))
        square = radius**2 + camera.spin**2
        return (square - camera.spin * photon.b) ** 2 - (square - 2 * radius) * photon.kappa

    # Rays that leave horizontally, or pass far from the sphere.
    size = min(2 * camera.radius, _FAR * radius)
    beyond = 2 * math.atan(2 * frame.zoom * frame.radius / (zoom * size))
    found = elementwise.find_root(potential, (np.zeros(_TABLE), reach - beyond), args=(edge_phase,))
    width = np.append(found.x, found.x[0])
    return CubicSpline(np.append(edge_phase, 2 * np.pi), width, bc_type="periodic")
