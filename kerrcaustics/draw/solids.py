"""Models in space as plain numbers: surfaces, lines and labels, for whatever draws or writes them.

A model is made of places (..., 3). Two kinds of models are made here: near the hole in Cartesian Boyer-Lindquist
coordinates (x, y = sqrt(r^2 + a^2) sin theta (cos phi, sin phi), z = r cos theta), and of all space with the radius
drawn as r / (r + c), so that the celestial sphere is the unit sphere.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from kerrcaustics.beams.beam import Status
from kerrcaustics.beams.paths import RayPaths, SpacePoints, cartesian
from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.curves.tubes import CausticTube
from kerrcaustics.draw import style
from kerrcaustics.draw.projection import whole_line
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

HORIZON_COLOUR = "#606060"
ERGOSPHERE_COLOUR = "#7f7fb5"
CAPTURED_COLOUR = "#a8a8a8"
CAMERA_COLOUR = "#000000"
DISK_COLOUR, DISK_RIM_COLOUR = "#e8dcc0", "#a08c5a"
# Entries of legends.
_HORIZON, _ERGOSPHERE = ("horizon", HORIZON_COLOUR), ("ergosphere", ERGOSPHERE_COLOUR)
_MIDDLE, _FINE = 48, 96
# Radius, units of M: the ergosphere's in the equatorial plane; the largest that is drawn at a half.
_TUBES_FROM, _LARGEST_SCALE = 2.0, 30.0


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface: points, colour "#rrggbb", opacity from 0 to 1; closed, the last column meets the first."""

    name: str
    points: Float[Array, "rows columns 3"]
    colour: str
    opacity: float = 1.0
    closed: bool = False

    def triangles(self) -> Int[Array, "n 3"]:
        """Corners (n, 3), as numbers of the points in reading order; triangles without an area are left out."""
        rows, columns = self.points.shape[:2]
        number = np.arange(rows * columns).reshape(rows, columns)
        if self.closed:
            number = np.concatenate([number, number[:, :1]], axis=1)
        a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
        corners = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
        size = np.linalg.norm(_area_vectors(self.points.reshape(-1, 3)[corners]), axis=1)
        return corners[size > 1e-12 * size.max(initial=0)]

    def normals(self) -> Float[Array, "points 3"]:
        """Unit normals (points, 3) at the points in reading order, on one side throughout."""
        places = self.points.reshape(-1, 3)
        corners = self.triangles()
        across = _area_vectors(places[corners])
        total = np.stack([np.bincount(corners.ravel(), np.repeat(part, 3), len(places)) for part in across.T], axis=1)
        size = np.linalg.norm(total, axis=1, keepdims=True)
        return np.where(size > 0, total / np.where(size > 0, size, 1), [0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class SpaceCurve:
    """A line in space: points, colour "#rrggbb", width in pixels of a picture 1200 high."""

    name: str
    points: Float[Array, "n 3"]
    colour: str
    width: float = 3.0
    opacity: float = field(default=1.0, init=False)


@dataclass(frozen=True, eq=False)
class Model:
    """Surfaces and lines in space. key: (words, colour) for the legend; look: (azimuth, elevation) of the eye, degrees.

    extent: radius of the sphere round the hole that fills the picture.
    """

    title: str
    surfaces: tuple[Surface, ...]
    lines: tuple[SpaceCurve, ...]
    key: tuple[tuple[str, str], ...]
    look: tuple[float, float] = (-60.0, 25.0)
    extent: float = 1.0


def _area_vectors(triangles: Float[Array, "n 3 3"]) -> Float[Array, "n 3"]:
    """Vectors across triangles (corners, components), twice their area long."""
    p, q, r = np.moveaxis(triangles, 1, 0)
    return np.cross(q - p, r - p)


def in_all_space(points: SpacePoints, scale: float) -> Float[Array, "*batch 3"]:
    """Places (..., 3) with the radius drawn as r / (r + scale), along the direction of the angles."""
    return _drawn_radius(points.radius, scale)[..., None] * points.direction


def _drawn_radius(radius: Float[Array, "*batch"], scale: float) -> Float[Array, "*batch"]:
    """r / (r + scale), 1 at infinity."""
    with np.errstate(divide="ignore"):
        return 1 / (1 + scale / radius)


def _viewer_label(camera: Viewer) -> str:
    """The viewer in a title."""
    kind = type(camera).__name__.lower()
    place = f"{kind} at infinity" if math.isinf(camera.radius) else f"{kind} at r = {camera.radius:g} M"
    return f"spin {camera.spin:g}, {place}"


def tubes_model(camera: Viewer, tubes: tuple[CausticTube, ...]) -> Model:
    """The caustic tubes of a viewer from next to the hole to the celestial sphere; radius drawn as r / (r + c).

    The scale c is the viewer's radius, and 30 M for those farther away. The tubes are cut off where they come to the
    ergosphere: inside, they wind round the hole closer and closer.
    """
    scale = min(camera.radius, _LARGEST_SCALE)
    hole = kerr.horizon(camera.spin)
    surfaces = [Surface("horizon", hole / (hole + scale) * _sphere(), HORIZON_COLOUR)]
    place = 1 / (1 + scale / camera.radius) * from_angles(camera.inclination, 0.0)
    lines, key = [*_sky_frame(), _spin_axis(1.1), *_camera_mark(place)], []
    for tube in tubes:
        colour, name = style.order_colour(tube.order), style.order_name(tube.order)
        points = in_all_space(tube.points, scale)
        outside = np.flatnonzero(tube.points.radius.min(axis=1) > _TUBES_FROM)
        points = points[: outside[-1] + 1] if len(outside) else points
        surfaces.append(Surface(f"{name} tube", points, colour, 1.0 if tube.order == 1 else 0.3, closed=True))
        lines.append(SpaceCurve(f"{name} caustic", whole_line(points[0], True), colour, 5.0))
        key.append((f"{name} caustic", colour))
    title = f"Caustic tubes, {_viewer_label(camera)}; radius drawn as r / (r + {scale:g} M)"
    return Model(title, tuple(surfaces), tuple(lines), (*key, _HORIZON), (-20.0, 32.0), extent=1.25)


def rays_model(camera: Viewer, paths: RayPaths, reach: float = 12.0) -> Model:
    """Rays near the hole, one colour for each Morse index, in Cartesian Boyer-Lindquist coordinates.

    Rays end on a sphere, where they are marked: beyond it they are nearly straight.

    Parameters
    ----------
    camera : Camera
    paths : RayPaths
        Of shape (rays, places).
    reach : float
        Radius of that sphere, units of M.
    """
    captured = paths.status == Status.CAPTURED
    lines = [_spin_axis(0.6 * reach), *_viewer_mark(camera, reach)]
    lines += [SpaceCurve("sphere", reach * part.points, part.colour, part.width) for part in _sky_frame()]
    for position, radius, index, lost in zip(paths.position, paths.radius, paths.index, captured, strict=True):
        part = _first_stretch(position, radius, reach)
        if index >= 0 and len(part) > 1:
            lines += _ray(part, int(index), bool(lost), 0.012 * reach)
    indices = sorted({int(k) for k in paths.index[(paths.index >= 0) & ~captured]})
    key = [(f"index {k}", style.index_colour(k)) for k in indices]
    key += [("captured", CAPTURED_COLOUR)] * bool(captured.any())
    key += [_ERGOSPHERE, _HORIZON, (f"sphere of r = {reach:g} M", "#9a9a9a")]
    title = f"Rays of one viewer, {_viewer_label(camera)}"
    return Model(title, tuple(_hole(camera.spin)), tuple(lines), tuple(key), (-70.0, 38.0), extent=1.02 * reach)


def _first_stretch(points: Float[Array, "n 3"], radius: Float[Array, " n"], reach: float) -> Float[Array, "m 3"]:
    """The first stretch of a ray within a radius: rays of viewers farther out come in first, and leave once.

    A ray that leaves ends there, on the straight line between two of its places.
    """
    inside = np.append(radius <= reach, False)
    first = int(inside.argmax())
    last = first + int((~inside[first:]).argmax())
    if not 0 < last < len(points):
        return points[first:last]
    part = (reach - radius[last - 1]) / (radius[last] - radius[last - 1])
    return np.append(points[first:last], [(1 - part) * points[last - 1] + part * points[last]], axis=0)


def _ray(points: Float[Array, "n 3"], index: int, captured: bool, size: float) -> list[SpaceCurve]:
    """A ray, and a mark of a size where it ends on the sphere."""
    if captured:
        return [SpaceCurve("captured ray", points, CAPTURED_COLOUR, 3.0)]
    colour = style.index_colour(index)
    ends = [SpaceCurve("end", bar, colour, 7.0) for bar in _cross(points[-1], size)]
    return [SpaceCurve(f"ray of index {index}", points, colour, 4.0), *ends]


def disk_rays_model(camera: Viewer, paths: RayPaths, crossing: Int[Array, " rays"], rims: tuple[float, float]) -> Model:
    """Rays that end on a disk in the equatorial plane, one colour for each crossing of it at which they end.

    Parameters
    ----------
    camera : Camera
    paths : RayPaths
        Of shape (rays, places), each at least as far as its crossing.
    crossing : (rays,) array
        Whole numbers: at which crossing each ray meets the disk.
    rims : (float, float)
        Radii of the inner and the outer rim, units of M.
    """
    inner, outer = (math.hypot(rim, camera.spin) * _parallel(math.pi / 2, 2 * _FINE) for rim in rims)
    surfaces = (*_hole(camera.spin), Surface("disk", np.stack([inner, outer]), DISK_COLOUR, 0.55))
    # As far as the camera, or to the edge of the picture.
    reach = min(camera.radius, 1.8 * rims[1])
    lines = [SpaceCurve("rim", rim, DISK_RIM_COLOUR, 2.0) for rim in (inner, outer)]
    lines += [_spin_axis(0.6 * rims[1]), *_viewer_mark(camera, reach)]
    for position, number in zip(paths.position, crossing, strict=True):
        ray = _until_plane(position, int(number))
        ray = ray[np.linalg.norm(ray, axis=1) <= math.hypot(reach, camera.spin)]
        lines.append(SpaceCurve(f"ray to crossing {number}", ray, style.crossing_colour(number), 4.0))
        lines += [SpaceCurve("end", dot, style.crossing_colour(number), 8.0) for dot in _cross(ray[-1], 0.012 * reach)]
    names = {1: "first", 2: "second", 3: "third"}
    key = [(f"{names.get(n, f'{n}th')} crossing", style.crossing_colour(n)) for n in sorted({int(n) for n in crossing})]
    key += [("camera", CAMERA_COLOUR), ("disk", DISK_RIM_COLOUR), _ERGOSPHERE, _HORIZON]
    title = f"Rays that end on a disk, {_viewer_label(camera)}"
    return Model(title, surfaces, tuple(lines), tuple(key), (-62.0, 24.0), extent=0.8 * reach)


def _until_plane(points: Float[Array, "n 3"], crossing: int) -> Float[Array, "m 3"]:
    """A path up to where it crosses the plane z = 0 for the n-th time: a straight line between two of its places."""
    height = points[:, 2]
    last = np.flatnonzero(height[1:] * height[:-1] < 0)[crossing - 1]
    part = height[last] / (height[last] - height[last + 1])
    return np.concatenate([points[: last + 1], [points[last] + part * (points[last + 1] - points[last])]])


def trapped_model(orbit: SpacePoints) -> Model:
    """A photon's orbit on its sphere: radius and angles drawn as if they were spherical coordinates (JTFT fig 11)."""
    radius = float(orbit.radius[0])
    colour = style.PALETTE[1]
    places = 1.004 * radius * orbit.direction
    surfaces = (Surface("sphere of the orbit", radius * _sphere(_FINE), "#c9d8e6", 0.8),)
    least = float(orbit.theta.min())
    lines = [SpaceCurve("orbit", places, colour, 5.0), _spin_axis(1.12 * radius)]
    for theta, name in ((math.pi / 2, "equator"), (least, "turning latitude"), (math.pi - least, "turning latitude")):
        lines.append(SpaceCurve(name, 1.002 * radius * _parallel(theta), "#6f7f8f", 2.0))
    key = (("photon orbit", colour), ("equator, turning latitudes", "#6f7f8f"))
    title = f"Trapped photon, spin {orbit.spin:g}, orbit at r = {radius:.4f} M"
    return Model(title, surfaces, tuple(lines), key, (-40.0, 22.0), extent=1.15 * radius)


def celestial_model(caustics: CausticSet) -> Model:
    """The celestial sphere with the caustics wound round it, seen from outside."""
    surfaces = (Surface("celestial sphere", 0.985 * _sphere(_FINE), "#ececec", 0.55),)
    lines = [*_sky_frame(), _spin_axis(1.1)]
    # The highest order lies lowest, so that the lower ones are seen.
    for caustic in reversed(caustics):
        places = from_angles(*caustic.celestial.T)
        width = 6.0 if caustic.order == 1 else 6.0 / caustic.order**0.7
        height = 1 + 0.004 * (len(caustics) - caustic.order)
        colour = style.order_colour(caustic.order)
        line = height * whole_line(places, caustic.closed)
        lines.append(SpaceCurve(f"{style.order_name(caustic.order)} caustic", line, colour, width))
    key = tuple(
        (f"{style.order_name(c.order)}, {c.circuits:.3g} circuits", style.order_colour(c.order)) for c in caustics
    )
    title = f"Caustics on the celestial sphere, {_viewer_label(caustics.camera)}"
    first = math.degrees(float(caustics[0].celestial[:, 1].mean())) if caustics else 0.0
    return Model(title, surfaces, tuple(lines), key, (first - 25, 20.0), extent=1.27)


def _sphere(rows: int = _MIDDLE) -> Float[Array, "rows 2*rows 3"]:
    return from_angles(*_angles(rows))


def _angles(rows: int) -> tuple[Float[Array, "rows 2*rows"], ...]:
    """theta and phi of a grid over a sphere."""
    return np.meshgrid(np.linspace(0, math.pi, rows), np.linspace(0, 2 * math.pi, 2 * rows), indexing="ij")


def _parallel(theta: float, count: int = 181) -> Float[Array, "count 3"]:
    """A circle of latitude on the unit sphere."""
    turn = np.linspace(0, 2 * math.pi, count)
    return from_angles(np.full_like(turn, theta), turn)


def _hole(spin: float) -> list[Surface]:
    """Horizon and ergosphere in Cartesian Boyer-Lindquist coordinates."""
    theta, phi = _angles(_MIDDLE)
    static = 1 + np.sqrt(1 - (spin * np.cos(theta)) ** 2)
    horizon = np.full_like(theta, kerr.horizon(spin))
    solids = ((*_HORIZON, horizon, 1.0), (*_ERGOSPHERE, static, 0.4))
    return [Surface(name, _positions(spin, r, theta, phi), colour, opaque) for name, colour, r, opaque in solids]


def _sky_frame() -> list[SpaceCurve]:
    """Meridians and parallels of the celestial sphere, every 30 degrees."""
    along = np.linspace(0, math.pi, 91)
    grid = [from_angles(along, np.full_like(along, phi)) for phi in np.radians(np.arange(0, 360, 30))]
    grid += [_parallel(theta) for theta in np.radians(np.arange(30, 180, 30))]
    return [SpaceCurve("celestial sphere", places, "#d8d8d8", 1.0) for places in grid]


def _spin_axis(height: float) -> SpaceCurve:
    return SpaceCurve("spin axis", np.array([[0, 0, -height], [0, 0, height]]), "#6f6f6f", 1.5)


def _viewer_mark(camera: Viewer, reach: float) -> list[SpaceCurve]:
    """The viewer; one beyond what is shown, at its edge."""
    place = (np.array(value) for value in (min(camera.radius, reach), camera.inclination, 0.0))
    return _camera_mark(_positions(camera.spin, *place), 0.02 * reach)


def _positions(spin: float, radius: Array, theta: Array, phi: Array) -> Float[Array, "*batch 3"]:
    """Cartesian Boyer-Lindquist coordinates (..., 3) of places."""
    return cartesian(spin, radius, from_angles(theta, phi))


def _camera_mark(place: Float[Array, "3"], size: float = 0.03) -> list[SpaceCurve]:
    """A camera: a small cross in space."""
    return [SpaceCurve("camera", bar, CAMERA_COLOUR, 4.0) for bar in _cross(place, size)]


def _cross(place: Float[Array, "3"], size: float) -> Float[Array, "3 2 3"]:
    """Three bars (3, 2, 3) along the axes, through a place."""
    return place + size * np.stack([np.outer([-1, 1], axis) for axis in np.eye(3)])
