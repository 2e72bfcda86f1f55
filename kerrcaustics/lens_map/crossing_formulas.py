"""Mino times to a circle in the equatorial plane and to a crossing of that plane: a kernel is made of them.

On a line across the shadow edge the n-th crossing of the plane lies at a radius that grows outward. Whether it is less
than that of a circle follows from Mino times alone, which are finite at the horizon and at infinity.
"""

from typing import Any

import jax.numpy as jnp

from kerrcaustics.beams.kernels.programs import FRAME, SKY, Number, Program
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.frame import Frame, photon_of
from kerrcaustics.spacetime.polar import mino_time_to_plane

# Value for rays of which one of both times is infinite; times themselves are shorter.
_LARGEST = 1e3


def crossing_gap(frame: Frame, sky: tuple[Any, Any, Any], crossing: Any, radius: Any) -> Any:
    """Mino time by which the n-th crossing of the plane lies within a radius; negative if it lies beyond.

    Rays that fall in before the crossing count as within, those that escape before it as beyond. The radius may be that
    of the horizon, or infinite. The value is continuous along a line, and so vanishes on the image of the circle.

    Errors: 1e-15 divided by the relative distance of the outer roots of R from each other.
    """
    photon = photon_of(frame, sky)
    quartic = radial.factor(frame, photon)
    captured, inward = radial.is_captured(frame, photon, quartic), photon.rate[0] > 0
    at_infinity = jnp.isinf(radius)
    # A radius for the formulas where it is infinite, and is not used.
    finite = jnp.where(at_infinity, 2 * frame.radius, radius)
    start = radial.outer_start(frame, photon, quartic)
    reached = radial.outer_square(quartic, start, finite) > 0
    rising = radial.mino_time_to(frame, photon, quartic, finite, jnp.ones_like(captured))
    falling = radial.mino_time_to(frame, photon, quartic, finite, jnp.zeros_like(captured))
    plane = mino_time_to_plane(frame, photon, crossing)
    # Past a turning point above the viewer a ray falls in; past one below it escapes. Beside the rays that just reach
    # the circle both times are that to the turning point.
    above_roots = finite - 1 > quartic.lift
    from_outside = jnp.where(
        captured,
        plane - falling,
        jnp.where(inward & above_roots, jnp.minimum(plane - falling, rising - plane), -_LARGEST),
    )
    returns = captured & ~inward & reached & (finite - 1 < quartic.lift)
    leaves = jnp.where(at_infinity, radial.mino_time(frame, photon, quartic), rising) - plane
    from_inside = jnp.where(captured, jnp.where(returns, jnp.maximum(leaves, plane - falling), _LARGEST), leaves)
    from_inside = jnp.where(at_infinity & captured, _LARGEST, from_inside)
    gap = jnp.where(finite < frame.radius, from_outside, from_inside)
    return jnp.clip(jnp.where(jnp.isnan(gap), 0.0, gap), -_LARGEST, _LARGEST)


def programs() -> dict[str, Program]:
    """The kernel by its name."""
    return {"crossing_gap": Program(crossing_gap, (FRAME, SKY, Number.OF_RAY, Number.OF_RAY))}
