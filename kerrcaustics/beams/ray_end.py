"""The record that both engines return, and the quantities that can be requested."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np

from kerrcaustics.beams.beam import Status


@dataclass(frozen=True)
class RayOutputs:
    """Quantities to compute beside n': the kernel holds no others.

    beams: the first variation of the end.
    index: number of conjugate points of a beam.
    crossings: number of crossings of the equatorial plane.
    time: coordinate time.
    """

    beams: bool = False
    index: bool = False
    crossings: bool = False
    time: bool = False


A = TypeVar("A")
# A plain number: NumPy takes four times as long for those of an enum.
_INACCURATE = int(Status.INACCURATE)
# Whole numbers, flags that are False of rays that do not reach their end, and what results have no use for.
_WHOLE, _FLAGS = {"index", "crossings"}, {"closed_form", "outward", "index_certain", "crossings_certain"}
_UNUSED = {"noise", "time_noise"}


@dataclass(frozen=True, kw_only=True)
class RayEnd(Generic[A]):
    """Rays at their ends, as `Rays` and `Beams` have them.

    Quantities not requested are None, as are radius and outward of ends at infinity until the rays are finished. Rays
    that do not reach their end hold NaN. Arrays of JAX where the formulas are traced, elsewhere of NumPy, writable.

    direction: n'.
    azimuth: azimuth, unwrapped, radians.
    azimuth_error: error of the azimuth, radians.
    status: `Status` values but INACCURATE, which the tolerance decides.
    status_certain: True if rounding does not decide the status.
    error: error of the direction, radians.
    noise: part of that error that is round-off.
    closed_form: True if the ray is in closed form, and its formulas hold.
    redshift: redshift of a source at rest at infinity.
    radius: radius of the end.
    outward: True if the ray ends with growing radius.
    time: coordinate time.
    time_error: error of the time.
    time_noise: part of that error that is round-off.
    jacobian: Jacobian of the beam.
    jacobian_error: error of the Jacobian.
    diameter_error: error of the beam's diameters.
    index: number of conjugate points.
    index_certain: True if rounding does not decide the index.
    crossings: number of crossings of the equatorial plane.
    crossings_certain: True if rounding does not decide that number.
    """

    direction: A
    azimuth: A
    azimuth_error: A
    status: A
    status_certain: A
    error: A
    noise: A | None
    closed_form: A
    redshift: A
    radius: A | None = None
    outward: A | None = None
    time: A | None = None
    time_error: A | None = None
    time_noise: A | None = None
    jacobian: A | None = None
    jacobian_error: A | None = None
    diameter_error: A | None = None
    index: A | None = None
    index_certain: A | None = None
    crossings: A | None = None
    crossings_certain: A | None = None

    def only(self, outputs: RayOutputs) -> "RayEnd[A]":
        """The rays without the first variation, the index, the crossings or the time that are not requested."""
        if outputs.beams and outputs.index and outputs.crossings and (outputs.time or self.time is None):
            return self
        beams = {} if outputs.beams else {"jacobian": None, "jacobian_error": None, "diameter_error": None}
        index = {} if outputs.index else {"index": None, "index_certain": None}
        crossings = {} if outputs.crossings else {"crossings": None, "crossings_certain": None}
        time = {} if outputs.time else {"time": None, "time_error": None, "time_noise": None}
        return replace(self, **beams, **index, **crossings, **time)

    def _changed(self: "RayEnd[np.ndarray]", change: Callable[[np.ndarray], np.ndarray]) -> "RayEnd[np.ndarray]":
        """The rays with another array in the place of each."""
        return replace(self, **{name: change(values) for name, values in self.fields().items()})

    def rows(self: "RayEnd[np.ndarray]", chosen: np.ndarray | slice) -> "RayEnd[np.ndarray]":
        """The chosen rays."""
        return self._changed(lambda values: values[chosen])

    def replace_rows(self: "RayEnd[np.ndarray]", chosen: np.ndarray | slice, replacement: "RayEnd[np.ndarray]") -> None:
        """Write other rays in the place of the chosen ones, for all quantities that both hold."""
        new_values = vars(replacement)
        for name, mine in vars(self).items():
            if mine is not None and new_values[name] is not None:
                mine[chosen] = new_values[name]

    def room(self: "RayEnd[np.ndarray]", count: int) -> "RayEnd[np.ndarray]":
        """Empty arrays for `count` rays with the quantities of these."""
        return self._changed(lambda values: np.empty((count, *values.shape[1:]), values.dtype))

    def nowhere(self: "RayEnd[np.ndarray]", status: np.ndarray, certain: np.ndarray) -> "RayEnd[np.ndarray]":
        """Rays that do not reach their end, with the quantities of these and a status each; the formulas hold."""
        ends = self.room(len(status))
        for values in vars(ends).values():
            if values is not None:
                values[...] = np.nan if values.dtype == float else False
        return replace(ends, status=status, status_certain=certain, closed_form=np.ones(len(status), bool))

    def finished(self: "RayEnd[np.ndarray]", tolerance: float) -> dict[str, np.ndarray]:
        """The arrays that are not None as `Rays` and `Beams` hold them, by the names of their arguments.

        With the status by the tolerance, whole numbers as such, and all radii.
        """
        reached = np.isfinite(self.error)
        status = self.status.astype(np.int8)
        with np.errstate(invalid="ignore"):
            status[self.error > tolerance] = _INACCURATE

        ends = self.fields()
        ends["status"] = status
        ends["radius"] = np.where(reached, np.inf, np.nan) if self.radius is None else self.radius
        ends["outward"] = reached if self.outward is None else self.outward
        for name in _WHOLE & ends.keys():
            ends[name] = np.where(reached, ends[name], -1).astype(np.int32)
        for name in _FLAGS & ends.keys():
            ends[name] = ends[name] & reached
        for name in _UNUSED & ends.keys():
            del ends[name]
        return ends

    def fields(self: "RayEnd[np.ndarray]") -> dict[str, np.ndarray]:
        """The arrays that are not None, by name."""
        return {name: values for name, values in vars(self).items() if values is not None}
