"""The light of what circles a hole without spin, by rays in closed form: shares no code with the package.

A camera at rest looks at a source in the plane from a radius far outside its orbit. u = 1/r of a ray is a function of
the angle chi swept round the hole; its travel time is the integral of dchi / (b u^2 (1 - 2 u)). A bundle of rays has
the cross-section dA = b sin(chi) |dr / dalpha| dalpha dturn, whoever measures it; alpha, turn: polar coordinates on the
sky about the hole.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import elementwise

from ..disk_checks.schwarzschild import CRITICAL, reciprocal_radius
from .differences import difference

Array = np.ndarray

# Nodes of a travel time, and of a spot along its orbit.
_NODES, _ALONG = 80, 24
# Relative step of derivatives.
_STEP = 2e-3
_ROOTS = {"xrtol": 1e-15, "xatol": 1e-14}


@dataclass(frozen=True)
class Circle:
    """A source on a circle of a radius in the plane, at phi = 0 at time 0, and the camera's place: its phi is 0."""

    radius: float
    distance: float
    inclination: float

    @property
    def rate(self) -> float:
        """dphi / dt of the orbit."""
        return self.radius**-1.5

    def swept(self, phi: Array, image: int) -> Array:
        """The angle round the hole of an image (0, 1, 2): chi, 2 pi - chi, 2 pi + chi."""
        chi = np.arccos(math.sin(self.inclination) * np.cos(phi))
        return chi + 2 * math.pi * (image // 2) if image % 2 == 0 else math.pi * (image + 1) - chi

    def impact(self, swept: Array) -> Array:
        """b of rays that meet the circle after such an angle."""
        most = self.distance / math.sqrt(1 - 2 / self.distance) * (1 - 1e-12)

        def short(b: Array, swept: Array) -> Array:
            return 1 / self.radius - reciprocal_radius(b, swept, 1 / self.distance)

        bracket = np.full_like(swept, 1e-6), np.full_like(swept, most)
        return elementwise.find_root(short, bracket, args=(swept,), tolerances=_ROOTS).x

    def travel_time(self, b: Array, swept: Array) -> Array:
        """Coordinate time from the circle to the camera."""
        node, weight = np.polynomial.legendre.leggauss(_NODES)
        angle = swept[:, None] * (node + 1) / 2
        flat = np.broadcast_to(b[:, None], angle.shape).ravel(), angle.ravel()
        u = reciprocal_radius(*flat, 1 / self.distance).reshape(angle.shape)
        return swept / 2 * (weight / (b[:, None] * u**2 * (1 - 2 * u))).sum(axis=1)

    def emission(self, time: Array, image: int) -> Array:
        """Times at which light leaves the source that arrives at times."""

        def late(emitted: Array, time: Array) -> Array:
            swept = self.swept(self.rate * emitted, image)
            return emitted + self.travel_time(self.impact(swept), swept) - time

        longest = 4 * self.distance + 40 * (image + 1)
        return elementwise.find_root(late, (time - longest, time), args=(time,), tolerances=_ROOTS).x

    def light(self, time: Array, image: int, kind: str) -> Array:
        """Flux of one image of a point of luminosity 1, or of a spot of intensity 1 and area 1, at times (n,)."""
        phi = self.rate * self.emission(time, image)
        swept = self.swept(phi, image)
        b, r, lapse = self.impact(swept), self.radius, 1 - 2 / self.distance
        sine = np.abs(np.sin(swept))
        # r^2 |du / db| is |dr / db|.
        bend = r**2 * np.abs(self._slope(b, swept, image))
        cosine = np.sqrt(1 - lapse * (b / self.distance) ** 2)
        per_area = lapse / (self.distance**2 * cosine * sine * bend)
        sense = 1 if image % 2 == 0 else -1
        momentum = -sense * b * math.sin(self.inclination) * np.sin(phi) / sine
        ratio = math.sqrt(1 - 3 / r) / (1 - self.rate * momentum) / math.sqrt(lapse)
        if kind == "point":
            return ratio**4 * per_area / (4 * math.pi)
        # The cosine of emission in the frame of the spot, and its area there by dr r dphi.
        upward = np.sqrt(np.maximum(b**2 - momentum**2, 0)) * ratio * math.sqrt(lapse) / r
        return ratio**4 * per_area * upward / math.sqrt(1 - 3 / r)

    def _slope(self, b: Array, swept: Array, image: int) -> Array:
        """du / db after such an angle; of rays that wind, by the logarithm of their distance from the critical b."""
        winds = image > 0
        step = np.full_like(b, _STEP) if winds else _STEP * b

        def values(k: int) -> Array:
            moved = CRITICAL + (b - CRITICAL) * np.exp(k * step) if winds else b + k * step
            return reciprocal_radius(moved, swept, 1 / self.distance)

        return difference(values) / (step * (b - CRITICAL) if winds else step)

    def spread(self, time: Array, image: int, size: float) -> Array:
        """The same of a spot that is a Gaussian along its orbit, with a standard deviation."""
        node, weight = np.polynomial.hermite_e.hermegauss(_ALONG)
        late = node * size / (self.radius * self.rate)
        many = self.light((time[:, None] + late).ravel(), image, "spot").reshape(len(time), -1)
        return many @ weight / weight.sum()
