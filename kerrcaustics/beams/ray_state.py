"""The state of rays as both engines, their kernels and their callers hold it: plain tuples of numbers or arrays."""

import math
from typing import NamedTuple

from kerrcaustics.spacetime.arrays import Flags, Reals

LEAST_K = 2.0
"""Least k = q + b^2 for which the closed form holds.

The parameter of the polar elliptic functions is then at most 1/3, and there are no vortical rays. Escaping rays of
smaller k start outward, meet no turning point and no conjugate point, and take a Mino time of 1.2 at most.
"""

MOST_K = 2.001
"""Largest k of the formulas for small k, a little beyond LEAST_K, so that no ray falls between the two."""

DENSEST = 3.6
"""Steps of the integrator per radian of arc that bring its local error down to round-off."""

Row = tuple[Reals, ...]
Jacobian = tuple[Row, ...]


class Path(NamedTuple):
    """A point of a path, or of its variation: position (several components), its rate, and an angle psi.

    The position obeys a second-order equation, psi a first-order one; neither right-hand side holds the rate.
    """

    position: tuple[Reals, ...]
    rate: tuple[Reals, ...]
    psi: Reals


class Constants(NamedTuple):
    """Constants along a ray: U = 1 + a2 u^2 + a1 u^3 + a0 u^4, k = q + b^2, and b."""

    a2: Reals
    a1: Reals
    a0: Reals
    k: Reals
    b: Reals


class Aim(NamedTuple):
    """The aim of a ray, by roots and elliptic integrals alone.

    captured: True if the ray, followed on, falls in.
    lost: True if it does not reach its end.
    mino_time: Mino time to the end, 0 if lost.
    conditioning: factor by which it magnifies round-off in N, as deep in the field the energy at infinity is a small
        difference of large numbers.
    certain: True if double precision determines the first two.
    rising: True if it arrives with growing radius, at spheres.
    plane_rate: |z'| in the equatorial plane, if that is the end.
    """

    captured: Flags
    lost: Flags
    mino_time: Reals
    conditioning: Reals
    certain: Flags
    rising: Flags = False
    plane_rate: Reals = math.inf


class Arriving(NamedTuple):
    """The arrival of a ray: u = 1 / r, the sizes of u' and psi', and the radians of arc in a unit of Mino time."""

    u: Reals
    rate: Reals
    psi_rate: Reals
    speed: Reals

    @property
    def turning(self) -> Reals:
        """The part of psi in the rate of the end, per radian of arc."""
        return self.psi_rate / self.speed


class BundleState(NamedTuple):
    """A bundle of rays at one time.

    paths: rays, two variations and clocks.
    azimuth: azimuth of m, unwrapped, radians.
    local_error: summed errors of the steps.
    clock_error: summed errors of the steps of the clock.
    """

    paths: tuple[Path, ...]
    azimuth: Reals
    local_error: Reals
    clock_error: Reals


class Bundle(NamedTuple):
    """Constants along a bundle of rays.

    constants: constants of the rays.
    variations: their two variations.
    begin_time: Mino time at which places begin.
    end_time: Mino time at which places end, NaN for rays that are not followed.
    end_u: 1 / r where rays are left that do not reach their end.
    lost: True if the end is not reached.
    captured: True if the ray falls in.
    opening: rate in Mino time at which the beam opens at the viewer.
    first: the rays at the viewer.
    """

    constants: Constants
    variations: list[Constants]
    begin_time: Reals
    end_time: Reals
    end_u: Reals
    lost: Flags
    captured: Flags
    opening: Reals
    first: Path
