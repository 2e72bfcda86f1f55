"""Domains of the lens map: the part of the sky whose rays reach a surface, covered by lines across the shadow edge.

A sphere beyond the camera has one leaf: the lines of sky_lines.py. A ray that meets a sphere within the camera's radius
falls on it, and where it turns below, meets it a second time on its way out. So that domain has two leaves, joined
along the rim where rays only graze the sphere; a line runs down the first leaf from the direction of the hole to the
rim, and from there on the second one to the shadow edge, and its depth grows smoothly all the way. Where the sphere
lies within all photon orbits there is no rim: lines come to the shadow edge from inside. The equatorial plane is
reached in a ring about the shadow edge (circles_in_plane.py).
"""

import math
from dataclasses import dataclass
from functools import lru_cache, singledispatch
from typing import ClassVar, Literal

import numpy as np

from kerrcaustics.beams.ends import CelestialSphere, End, EquatorialPlane, Sphere, Spherical, end_of
from kerrcaustics.lens_map import sky_lines
from kerrcaustics.lens_map.circles_in_plane import Circles, circles_of
from kerrcaustics.lens_map.search_sky import TOLERANCE, search_camera
from kerrcaustics.numerics.roots import bracketed_roots
from kerrcaustics.numerics.splines import Spline
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.arrays import HostParts, HostVectors
from kerrcaustics.spacetime.checks import quoted
from kerrcaustics.spacetime.frame import photon_of, sky_from_fido
from kerrcaustics.spacetime.shadow import edge_photons, even_phases
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Points of the rim that are found; a spline joins them.
_TABLE = 2048
# How far below the horizontal a line begins where the sphere has the camera's own radius, radians: at least, and on a
# sky of size 1 by the rounding of a direction.
_BELOW, _ROUNDING = 1e-9, 4e-16
# Rays with an impact parameter of so many radii of a sphere that is outside all photon orbits miss it.
_FAR = 40.0


@dataclass(frozen=True)
class OneLeaf:
    """Lines to a sphere that every ray outside the shadow reaches once: one beyond the camera, or of its radius.

    camera: at rest at the event. level: True for a sphere of the camera's radius, to which only rays come back that
    leave inward. unbounded: True for an observer at infinity and the celestial sphere, where what is seen directly lies
    infinitely far out: rays at infinite (alpha, beta) all lead to the point opposite to the observer, the primary
    caustic.
    """

    camera: Viewer
    surface: Spherical
    level: bool = False
    unbounded: bool = False
    in_plane: ClassVar[Literal[False]] = False

    @property
    def radian_length(self) -> float:
        """Length along the surface for which a radian stands, in M: 1 on the celestial sphere."""
        return float(self.surface.radius) if self.surface.finite else 1.0

    @property
    def has_rim(self) -> bool:
        """True if some rays meet the sphere twice."""
        return False

    def rim(self, edge_phase: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Depth of the rim, if there is one."""
        raise NotImplementedError

    @property
    def falls(self) -> bool:
        """True if the rays that reach the surface fall in: those of the first arrival within the camera's radius."""
        return False

    @property
    def _nearest(self) -> float:
        """The least radius of camera and sphere."""
        return self.camera.radius

    @property
    def zoom(self) -> float:
        """The size of the sky on which lines run evenly, in units of the search sky, 1 or less.

        On an observer's screen lines run as on the sky of a camera where the sources are.
        """
        frame = self.camera.frame()
        return 1.0 if math.isinf(self._nearest) else min(1.0, frame.zoom * frame.radius / self._nearest)

    @property
    def sunk(self) -> float:
        """The excess of depths over those on the sky itself, about."""
        return -math.log(self.zoom)

    def first(self, edge_phase: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Depth at which lines begin."""
        if self.unbounded:
            away = math.acos(1 - self.camera.straight_ahead)
            return -np.log1p(-away / sky_lines.line_reach(self.camera, edge_phase))
        if not self.level:
            return np.zeros_like(edge_phase)
        reach = sky_lines.wide_reach(self.camera, edge_phase, self.zoom)
        return -np.log((reach - np.pi / 2 - self.gap) / reach)

    @property
    def gap(self) -> float:
        """Angle below the horizontal at which lines begin on a sphere of the camera's radius, radians."""
        return max(_BELOW, _ROUNDING / self.zoom)

    def line_of_sight(self, edge_phase: HostParts, depth: HostParts) -> tuple[HostVectors, Bool[Array, "*batch"]]:
        """Lines of sight (..., 3), and whether they stand for the second arrival; both arguments are broadcast."""
        first = np.zeros(np.broadcast_shapes(np.shape(edge_phase), np.shape(depth)), bool)
        if self.zoom == 1:
            return sky_lines.line_of_sight(self.camera, edge_phase, depth), first
        reach = sky_lines.wide_reach(self.camera, edge_phase, self.zoom)
        return self._wide_line_of_sight(edge_phase, reach * np.exp(-np.asarray(depth, float))), first

    def _wide_line_of_sight(self, edge_phase: HostParts, distance: HostParts) -> HostVectors:
        return sky_lines.on_wide_sky(self.camera, edge_phase, distance, self.zoom)

    def check(self) -> None:
        """Raise ValueError for spheres that some rays reach and others only wind toward."""
        if not self.surface.finite:
            return
        orbits = _edge_orbits(self.camera, np.linspace(0, 2 * np.pi, 721))
        low, high, horizon = float(orbits.min()), float(orbits.max()), kerr.horizon(self.camera.spin)
        if self.surface.radius > high or (self.falls and self.surface.radius < low):
            return
        below = f"in ({horizon:.6g}, {low:.6g}) or " if self.camera.radius > low else ""
        raise ValueError(
            f"Argument `end` must be {below}larger than {high:.6g} for this camera (between them lie photon orbits, "
            f"and no count is certain), but is {self.surface.radius:.12g}."
        )


class TwoLeaves(OneLeaf):
    """Lines to a sphere within the camera's radius, which rays fall on, and some meet again on their way out."""

    surface: Sphere

    @property
    def has_rim(self) -> bool:
        """True if some rays meet the sphere twice."""
        return _rim(self.camera, float(self.surface.radius), self.zoom) is not None

    def rim(self, edge_phase: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Depth of the rim, if there is one."""
        width = _rim(self.camera, float(self.surface.radius), self.zoom)
        assert width is not None
        size = np.pi - sky_lines.wide_reach(self.camera, edge_phase, self.zoom)
        return np.sqrt(2 * (1 + size / width(edge_phase)))

    @property
    def falls(self) -> bool:
        """True if the rays that reach the surface fall in: those of the first arrival within the camera's radius."""
        return not self.surface.second_arrival

    @property
    def _nearest(self) -> float:
        """The least radius of camera and sphere."""
        return float(self.surface.radius)

    def line_of_sight(self, edge_phase: HostParts, depth: HostParts) -> tuple[HostVectors, Bool[Array, "*batch"]]:
        """Lines of sight (..., 3), and whether they stand for the second arrival; both arguments are broadcast."""
        size = np.pi - sky_lines.wide_reach(self.camera, edge_phase, self.zoom)
        rim = _rim(self.camera, float(self.surface.radius), self.zoom)
        if rim is None:
            distance = -size * np.exp(-depth)
            return self._wide_line_of_sight(edge_phase, distance), np.zeros_like(distance, bool)
        # The two forms have one value and two derivatives in common at the rim.
        width, fold = rim(edge_phase), self.rim(edge_phase)
        away = depth - fold
        falling = width - (width + size) * (away / fold) ** 2
        # 1 / cosh, which has no overflow far down.
        part = np.exp(-np.maximum(away, 0))
        distance = np.where(away <= 0, falling, width * 2 * part / (1 + part * part))
        return self._wide_line_of_sight(edge_phase, distance), away > 0


@dataclass(frozen=True)
class Ring:
    """Circles in the equatorial plane, which rays cross between the horizon and infinity."""

    camera: Viewer
    surface: EquatorialPlane
    in_plane: ClassVar[Literal[True]] = True
    level: ClassVar[bool] = False
    unbounded: ClassVar[bool] = False
    falls: ClassVar[bool] = True
    radian_length: ClassVar[float] = 1.0

    def check(self) -> None:
        """Raise ValueError for cameras in the plane: there every crossing is a conjugate point of the rays along it."""
        if self.camera.on_equator:
            raise ValueError(
                "Argument `camera` must not lie in the equatorial plane if the sources do, but its inclination is "
                f"{self.camera.inclination:g} (90 degrees)."
            )

    def circles(self, *, many: bool = False, engine: str = "auto", tolerance: float = TOLERANCE) -> Circles:
        """The circles at the crossing, kept for the next source. many: on many lines."""
        self.check()
        return circles_of(search_camera(self.camera), self.surface.crossing, many, engine, tolerance)


Domain = OneLeaf | Ring


def search_surface(camera: Viewer, end: object) -> End:
    """The surface that `end=` means where all arrivals of rays count: ValueError for one of them alone."""
    surface = end_of(camera, end)
    if surface.has_second_arrivals:
        raise ValueError(
            "Argument `end` must be a sphere without second_arrival, as the images by both arrivals are found, but is "
            f"{quoted(end)}."
        )
    return surface


@singledispatch
def domain_of(surface: End, camera: Viewer) -> Domain:
    """The domain of a surface on the sky of a camera at rest: the one place that knows which surface it is."""
    raise TypeError(f"no domain of {type(surface).__name__}")


def leaves_of(surface: End, camera: Viewer) -> OneLeaf:
    """The domain of a sphere; TypeError for another surface, across which no lines run."""
    domain = domain_of(surface, camera)
    if not isinstance(domain, OneLeaf):
        raise TypeError(f"no lines across the shadow edge lead to {surface.in_words()}")
    return domain


def ring_of(surface: End, camera: Viewer) -> Ring:
    """The domain of the equatorial plane; TypeError for another surface."""
    domain = domain_of(surface, camera)
    if not isinstance(domain, Ring):
        raise TypeError(f"{surface.in_words()} is not reached in a ring about the shadow edge")
    return domain


@domain_of.register
def _of_sky(surface: CelestialSphere, camera: Viewer) -> Domain:
    return OneLeaf(camera, surface, unbounded=math.isinf(camera.radius))


@domain_of.register
def _of_sphere(surface: Sphere, camera: Viewer) -> Domain:
    if surface.radius < camera.radius:
        return TwoLeaves(camera, surface)
    return OneLeaf(camera, surface, level=surface.radius == camera.radius)


@domain_of.register
def _of_plane(surface: EquatorialPlane, camera: Viewer) -> Domain:
    return Ring(camera, surface)


def _edge_orbits(camera: Viewer, edge_phase: Float[Array, " edge_phases"]) -> Float[Array, " edge_phases"]:
    """Radii of the photon orbits toward which the rays of the shadow edge wind."""
    frame = camera.frame()
    photon = photon_of(frame, tuple(sky_from_fido(frame, edge_photons(camera, edge_phase)).T))
    return np.asarray(kerr.spherical_orbit_of_impact(camera.spin, photon.b)[0])


@lru_cache(maxsize=8)
def _rim(camera: Viewer, radius: float, zoom: float) -> Spline | None:
    """Distance from the shadow edge of rays that only graze a sphere, by edge phase; None if all that meet it fall in.

    zoom: of the sky on which that is measured.
    """
    edge_phase = even_phases(camera, np.arange(_TABLE) / _TABLE)
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
    root = bracketed_roots(potential, (np.zeros(_TABLE), reach - beyond), (edge_phase,))
    return sky_lines.periodic(edge_phase, root.x)
