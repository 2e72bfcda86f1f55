"""Half-lines from a place in the shadow, and the images of circles on them by integrated rays alone.

Rays are told apart by where they cross the plane: within a circle (or they fall into the hole before), or beyond it
(or they leave before). Where that changes along a half-line is found by bisection, for all half-lines together. The
search knows nothing of isoradials, of Mino time, or of the closed form.
"""

from typing import NamedTuple

import numpy as np

import kerrcaustics as kc
from kerrcaustics.spacetime.sphere import tangent_basis
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

TOLERANCE = 1e-13
# Steps of bisections: of the place, relative to its distance from the shadow edge.
_HALVINGS = 52
# Places along a half-line, even in the logarithm of the distance from the shadow edge, and the nearest of them.
_PLACES, _NEAREST = 90, 1e-10
# Of a direction in double precision, radians or by the place on a screen.
ROUNDING = 4e-16
# Signs of rays: within a circle, beyond it, or not known.
WITHIN, BEYOND, UNKNOWN = -1, 1, 0


class HalfLines(NamedTuple):
    """Half-lines (k,) from a place on the viewer's sky, evenly round about, to the end of the sky or to a distance."""

    viewer: Viewer
    centre: Array
    angle: Array
    last: float

    def at(self, distance: Array) -> Array:
        """Places (..., k, axes) at distances (..., k) from the centre: radians, or M on a screen."""
        across = np.stack([np.cos(self.angle), np.sin(self.angle)], axis=-1)
        if len(self.centre) == 2:
            return self.centre + distance[..., None] * across
        ways = across @ np.stack(tangent_basis(self.centre))
        return np.cos(distance)[..., None] * self.centre + np.sin(distance)[..., None] * ways

    def density(self, distance: Array) -> Array:
        """Area of the sky by angle round the centre and by distance."""
        return distance if len(self.centre) == 2 else np.sin(distance)

    def some(self, chosen: Array) -> "HalfLines":
        """Chosen half-lines."""
        return self._replace(angle=self.angle[chosen])


def half_lines(viewer: Viewer, count: int, last: float) -> HalfLines | None:
    """Half-lines from the middle of the shadow; None where that is not in it. last: the end of those on a screen."""
    middle = kc.shadow_edge(viewer, 64).mean(axis=0)
    on_screen = isinstance(viewer, kc.Observer)
    centre = middle if on_screen else middle / np.linalg.norm(middle)
    lines = HalfLines(viewer, centre, np.arange(count) * 2 * np.pi / count, last if on_screen else np.pi)
    captured = kc.trace_rays(viewer, centre[None], "integrated").status[0] == kc.Status.CAPTURED
    return lines if captured else None


def sides(viewer: Viewer, sky: Array, crossing: int, radius: float) -> Array:
    """WITHIN, BEYOND or UNKNOWN, for places (..., axes); no circle at a crossing of 0, but the shadow itself."""
    flat = sky.reshape(-1, sky.shape[-1])
    if not crossing:
        rays = kc.trace_rays(viewer, flat, "integrated", TOLERANCE)
        return np.where(rays.status == kc.Status.CAPTURED, WITHIN, BEYOND).reshape(sky.shape[:-1])
    rays = kc.trace_rays(viewer, flat, "integrated", TOLERANCE, end=kc.EquatorialPlane(crossing))
    met = np.isfinite(rays.radius)
    with np.errstate(invalid="ignore", divide="ignore"):
        gap = np.log(rays.radius / radius)
    known = np.where(np.abs(gap) > 3 * rays.error, np.sign(gap), UNKNOWN)
    lost = np.where(rays.status == kc.Status.CAPTURED, WITHIN, BEYOND)
    return np.where(met, known, lost).astype(int).reshape(sky.shape[:-1])


class CircleOnLines(NamedTuple):
    """The image of a circle, or of an end of the plane, where each half-line meets it once.

    edge: (k,) distance of the shadow edge from the centre.
    beyond: (k,) distance of the image from the shadow edge, negative inside.
    error: (k,) by which it may be off.
    """

    edge: Array
    beyond: Array
    error: Array

    @property
    def distance(self) -> Array:
        """Distance from the centre."""
        return self.edge + self.beyond


def shadow_on(lines: HalfLines) -> Array:
    """Distances (k,) of the shadow edge from the centre."""
    low, high = np.zeros(len(lines.angle)), np.full(len(lines.angle), lines.last)
    for _ in range(60):
        middle = (low + high) / 2
        inside = sides(lines.viewer, lines.at(middle), 0, 0.0) == WITHIN
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return (low + high) / 2


def circle_on(lines: HalfLines, edge: Array, crossing: int, radius: float) -> CircleOnLines | None:
    """The image of a circle; None where some half-line does not meet it once. radius: 0 is the horizon."""
    out = np.geomspace(_NEAREST, 1, _PLACES)[:, None] * (lines.last - edge) * (1 - 1e-9)
    inward = -np.geomspace(1, _NEAREST, _PLACES)[:, None] * edge
    places = np.concatenate([inward, out])
    seen = sides(lines.viewer, lines.at(edge + places), crossing, radius)
    # What is not known is between known places.
    for i in range(1, len(seen)):
        seen[i] = np.where(seen[i] == UNKNOWN, seen[i - 1], seen[i])
    changes = seen[1:] != seen[:-1]
    if not ((changes.sum(axis=0) == 1).all() and (seen[0] == WITHIN).all()):
        return None
    at = np.clip(np.argmax(changes, axis=0), 1, len(places) - 3)
    ends = [np.take_along_axis(places, (at + k)[None], axis=0)[0] for k in (-1, 0, 1, 2)]

    def changed(side: int, low: Array, high: Array) -> Array:
        """Where rays are on a side, or farther."""
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            before = sides(lines.viewer, lines.at(edge + middle), crossing, radius) < side
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return (low + high) / 2

    # From where on it is not known any more, and from where on it is again.
    first, last = changed(UNKNOWN, *ends[::2]), changed(BEYOND, *ends[1::2])
    found = (first + last) / 2
    return CircleOnLines(edge, found, np.abs(last - first) / 2 + ROUNDING * (1 + edge) + 1e-13 * np.abs(found))


def area_between(lines: HalfLines, inner: CircleOnLines, outer: CircleOnLines) -> tuple[float, float]:
    """Area between two images and its error: that of the edges, and the difference from every second half-line."""
    gap, middle = outer.beyond - inner.beyond, inner.edge + (inner.beyond + outer.beyond) / 2
    part = gap * middle if len(lines.centre) == 2 else 2 * np.sin(gap / 2) * np.sin(middle)
    step = 2 * np.pi / len(part)
    density = np.abs(lines.density(middle))
    off = step * float(density @ (inner.error + outer.error))
    size = step * float(part.sum())
    return size, off + abs(size - 2 * step * float(part[::2].sum()))
