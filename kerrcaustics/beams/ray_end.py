"""The one record that both engines return, and what may be asked of them."""

from dataclasses import dataclass, replace
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np

from kerrcaustics.beams.beam import Status

Array = Any


@dataclass(frozen=True)
class Wanted:
    """What to compute beside n': what is left out is not in the compiled program.

    beams, the first variation of the end; index, of a beam, the number of conjugate points; crossings of the equatorial
    plane; time, the coordinate time.
    """

    beams: bool = False
    index: bool = False
    crossings: bool = False
    time: bool = False


@jax.tree_util.register_dataclass
@dataclass(frozen=True, kw_only=True)
class RayEnd:
    """Rays at their ends, as `Rays` and `Beams` have them. What was not asked for, or is none there, is None.

    status: `Status` values but INACCURATE, which the tolerance decides; noise and time_noise, the parts of the two
    errors that are round-off; closed_form, whether the closed form gave the ray and its formulas hold. Rays that do not
    reach their end hold NaN. Arrays of JAX out of compiled code; of NumPy, which can be written to, on the host.
    """

    direction: Array
    azimuth: Array
    status: Array
    error: Array
    noise: Array | None
    closed_form: Array
    radius: Array | None = None
    time: Array | None = None
    time_error: Array | None = None
    time_noise: Array | None = None
    redshift: Array | None = None
    jacobian: Array | None = None
    jacobian_error: Array | None = None
    index: Array | None = None
    crossings: Array | None = None

    def rows(self, chosen: np.ndarray | slice) -> Self:
        """The chosen rays."""
        return jax.tree.map(lambda values: values[chosen], self)

    def put(self, chosen: np.ndarray | slice, others: "RayEnd") -> None:
        """Write other rays in the place of the chosen ones, in all that both hold."""
        theirs = vars(others)
        for name, mine in vars(self).items():
            if mine is not None and theirs[name] is not None:
                mine[chosen] = theirs[name]

    def room(self, count: int) -> Self:
        """So many rays with nothing written yet, of what these hold."""
        return jax.tree.map(lambda values: np.empty((count, *values.shape[1:]), values.dtype), self)

    def nowhere(self, status: np.ndarray) -> Self:
        """Rays that do not reach their end, with a status each, holding what these hold: the formulas do hold."""
        ends = self.room(len(status))
        for values in vars(ends).values():
            if values is not None and values.dtype == float:
                values[...] = np.nan
        return replace(ends, status=status, closed_form=np.ones(len(status), bool))

    def shaped(self, shape: tuple[int, ...]) -> Self:
        """The rays in a batch shape."""
        return jax.tree.map(lambda values: values.reshape((*shape, *values.shape[1:])), self)

    def finished(self, tolerance: float) -> Self:
        """The rays as a result holds them: judged by the tolerance, whole numbers as such."""
        reached = np.isfinite(self.error)
        with np.errstate(invalid="ignore"):
            status = np.where(self.error > tolerance, Status.INACCURATE, self.status).astype(np.int8)

        def whole(number: np.ndarray | None) -> np.ndarray | None:
            return None if number is None else np.where(reached, number, -1).astype(np.int32)

        return replace(
            self,
            status=status,
            noise=None,
            time_noise=None,
            closed_form=self.closed_form & reached,
            index=whole(self.index),
            crossings=whole(self.crossings),
        )

    def fields(self) -> dict[str, np.ndarray]:
        """What there is, by name, as `Rays` and `Beams` take it."""
        return {name: values for name, values in vars(self).items() if values is not None}


def status_of(lost: Array, captured: Array) -> Array:
    """The status of rays, of which some do not reach their end, and some would fall in."""
    return jnp.where(lost, jnp.where(captured, Status.CAPTURED, Status.MISSED), Status.ESCAPED).astype(jnp.int8)


def stacked(rows: tuple[Any, ...], hidden: Array) -> Array:
    """Components, or rows of them, along the last axes, with `hidden` added to each."""
    if isinstance(rows[0], tuple):
        return jnp.stack([stacked(row, hidden) for row in rows], axis=-2)
    return jnp.stack([part + hidden for part in rows], axis=-1)
