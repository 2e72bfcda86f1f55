"""The record that both engines return, and the quantities that can be requested."""

from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from kerrcaustics.beams.beam import Status
from kerrcaustics.spacetime.arrays import Flags, Reals


@dataclass(frozen=True)
class Wanted:
    """Quantities to compute beside n': the compiled program holds no others.

    beams, the first variation of the end; index, of a beam, the number of conjugate points; crossings of the equatorial
    plane; time, the coordinate time.
    """

    beams: bool = False
    index: bool = False
    crossings: bool = False
    time: bool = False


A = TypeVar("A")


@jax.tree_util.register_dataclass
@dataclass(frozen=True, kw_only=True)
class RayEnd(Generic[A]):
    """Rays at their ends, as `Rays` and `Beams` have them. Quantities not requested are None.

    So are radius and outward of ends at infinity, until the rays are finished.

    status: `Status` values but INACCURATE, which the tolerance decides; noise and time_noise, the parts of the two
    errors that are round-off; closed_form: the ray is in closed form, and its formulas hold. Rays that do not
    reach their end hold NaN. Arrays of JAX out of compiled code; of NumPy, which can be written to, on the host.
    """

    direction: A
    azimuth: A
    azimuth_error: A
    status: A
    status_certain: A
    error: A
    noise: A | None
    closed_form: A
    radius: A | None = None
    outward: A | None = None
    time: A | None = None
    time_error: A | None = None
    time_noise: A | None = None
    redshift: A | None = None
    impact: A | None = None
    impact_error: A | None = None
    carter: A | None = None
    carter_error: A | None = None
    emission_cosine: A | None = None
    emission_error: A | None = None
    jacobian: A | None = None
    jacobian_error: A | None = None
    diameter_error: A | None = None
    index: A | None = None
    index_certain: A | None = None
    crossings: A | None = None
    crossings_certain: A | None = None

    def only(self, wanted: Wanted) -> "RayEnd[A]":
        """The rays without the index, the crossings or the time that are not requested."""
        index = {} if wanted.index else {"index": None, "index_certain": None}
        crossings = {} if wanted.crossings else {"crossings": None, "crossings_certain": None}
        time = {} if wanted.time else {"time": None, "time_error": None, "time_noise": None}
        return replace(self, **index, **crossings, **time)

    def rows(self, chosen: np.ndarray | slice) -> "RayEnd[A]":
        """The chosen rays."""
        return jax.tree.map(lambda values: values[chosen], self)

    def put(self, chosen: np.ndarray | slice, replacement: "RayEnd[np.ndarray]") -> None:
        """Write other rays in the place of the chosen ones, for all quantities that both hold."""
        new_values = vars(replacement)
        for name, mine in vars(self).items():
            if mine is not None and new_values[name] is not None:
                mine[chosen] = new_values[name]

    def room(self, count: int) -> "RayEnd[A]":
        """Empty arrays for `count` rays with the quantities of these."""
        return jax.tree.map(lambda values: np.empty((count, *values.shape[1:]), values.dtype), self)

    def nowhere(self, status: np.ndarray, certain: np.ndarray) -> "RayEnd[A]":
        """Rays that do not reach their end, with the quantities of these and a status each; the formulas hold."""
        ends = self.room(len(status))
        for values in vars(ends).values():
            if values is not None:
                values[...] = np.nan if values.dtype == float else False
        return replace(ends, status=status, status_certain=certain, closed_form=np.ones(len(status), bool))

    def shaped(self, shape: tuple[int, ...]) -> "RayEnd[A]":
        """The rays in a batch shape."""
        return jax.tree.map(lambda values: values.reshape((*shape, *values.shape[1:])), self)

    def finished(self: "RayEnd[np.ndarray]", tolerance: float) -> "RayEnd[np.ndarray]":
        """The rays as a result holds them: with the status by the tolerance, whole numbers as such, and all radii."""
        reached = np.isfinite(self.error)
        with np.errstate(invalid="ignore"):
            status = np.where(self.error > tolerance, Status.INACCURATE, self.status).astype(np.int8)

        def whole(number: np.ndarray | None) -> np.ndarray | None:
            return None if number is None else np.where(reached, number, -1).astype(np.int32)

        def known(flags: np.ndarray | None) -> np.ndarray | None:
            return None if flags is None else flags & reached

        return replace(
            self,
            status=status,
            noise=None,
            time_noise=None,
            closed_form=self.closed_form & reached,
            radius=np.where(reached, np.inf, np.nan) if self.radius is None else self.radius,
            outward=reached if self.outward is None else known(self.outward),
            index=whole(self.index),
            index_certain=known(self.index_certain),
            crossings=whole(self.crossings),
            crossings_certain=known(self.crossings_certain),
        )

    def fields(self) -> dict[str, np.ndarray]:
        """The arrays that are not None, by name, as arguments of `Rays` and `Beams`."""
        return {name: values for name, values in vars(self).items() if values is not None}


def status_of(lost: Flags, captured: Flags) -> Reals:
    """The status of rays from the flags of those that do not reach their end, and of those that would fall in."""
    return jnp.where(lost, jnp.where(captured, Status.CAPTURED, Status.MISSED), Status.ESCAPED).astype(jnp.int8)


def stacked(rows: tuple[Any, ...], hidden: Reals) -> Float[Array, "..."]:
    """Components, or rows of them, along the last axes, with `hidden` added to each."""
    if isinstance(rows[0], tuple):
        return jnp.stack([stacked(row, hidden) for row in rows], axis=-2)
    return jnp.stack([part + hidden for part in rows], axis=-1)
