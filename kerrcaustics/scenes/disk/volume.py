"""Matter that fills space round the hole: its density, temperature and motion."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.scenes.colour import ResponseLike, check_response
from kerrcaustics.scenes.scene_checks import (
    check_above_horizon,
    check_brightness,
    check_light,
    check_number,
    check_rims,
    not_negative,
    positive,
)
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import numbers, quoted, real_array
from kerrcaustics.spacetime.kerr import horizon_product

Array = np.ndarray
Law = Callable[[Array, Array, Array], Any]

VOLUME_MOTIONS = ("circular", "fiducial", "static")

_MOST_CELLS = 512


class VolumeLaw(ABC):
    """A law of a volume with a known symmetry, which can be turned about the spin axis."""

    @property
    @abstractmethod
    def symmetric(self) -> bool:
        """True if it is the same at all azimuths."""

    @abstractmethod
    def turned_by(self, angle: float) -> Any:
        """The law turned by an angle (radians, toward larger phi)."""


class VolumeGrid(VolumeLaw):
    """Numbers on a grid in space: cells of equal size in log r, theta and phi.

    Parameters
    ----------
    values : (radii, thetas, azimuths) array
        From the inner to the outer radius, from the north pole to the south pole, once round from phi = 0; not
        negative. One azimuth is enough for a symmetric grid. With one more axis, of 3, they are colours: linear sRGB.
    inner, outer : float
        Radii of the grid's ends, not of the middles of its cells.
    weights : (radii, thetas, azimuths) array, optional
        Weights of the cells in all means: the density for a temperature or a colour, so that cells count by their
        absorption.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    Linear between the middles of cells, and periodic round the axis. Means over a beam come from a pyramid of grids,
    each half as fine as the one before: a beam as wide as 2^k cells sees the k-th grid, and beams in between a mixture
    of two.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> import numpy as np
    >>> kc.disks.VolumeGrid(np.ones((4, 4, 1)), inner=5.0, outer=8.0)
    <VolumeGrid of 4 x 4 x 1 cells>
    """

    def __init__(self, values: ArrayLike, inner: float, outer: float, weights: ArrayLike | None = None) -> None:
        """Make the pyramid."""
        grid = numbers("values", values)
        if grid.ndim not in (3, 4) or grid.shape[3:] not in ((), (3,)) or not _few_cells(grid.shape[:3]):
            shape = f"(radii, thetas, azimuths), each 1 to {_MOST_CELLS}, or one more axis of 3"
            raise ValueError(f"Argument `values` must have shape {shape}, but has {grid.shape}.")
        check_light("values", grid)
        check_rims(inner, outer)
        self.inner, self.outer, self.shape, self._turn = float(inner), float(outer), grid.shape[:3], 0.0
        self.coloured, self.weighted = grid.ndim == 4, weights is not None
        channels = grid if self.coloured else grid[..., None]
        if weights is not None:
            share = _checked_weights(weights, self.shape)
            channels = np.concatenate([channels * share, share], axis=-1)
        self._levels = [channels]
        while max(self._levels[-1].shape[:3]) > 1:
            self._levels.append(_halved(self._levels[-1]))

    def __repr__(self) -> str:
        """Return a line with its size."""
        return f"<VolumeGrid of {' x '.join(str(size) for size in self.shape)} cells>"

    @property
    def cell(self) -> float:
        """Smallest side of a cell, in units of its radius; an axis with one cell has no side."""
        sides = (math.log(self.outer / self.inner), math.pi, 2 * math.pi)
        lengths = [side / count for side, count in zip(sides, self.shape, strict=True) if count > 1]
        return min(lengths, default=sides[0])

    @property
    def symmetric(self) -> bool:
        """True if it is the same at all azimuths."""
        return self.shape[2] == 1

    def turned_by(self, angle: float) -> "VolumeGrid":
        """The grid turned about the spin axis by an angle (radians, toward larger phi)."""
        grid = copy(self)
        grid._turn += angle
        return grid

    def mean(
        self, radius: Float[Array, " n"], theta: Float[Array, " n"], azimuth: Float[Array, " n"], width: ArrayLike = 0.0
    ) -> Float[Array, "*shape"]:
        """Values (n,), or colours (n, 3), about places, averaged over the width (n,) of a beam (units of the mass)."""
        outward = np.log(radius / self.inner) / math.log(self.outer / self.inner)
        place = outward, theta / math.pi, (azimuth - self._turn) / (2 * math.pi) % 1.0
        size = np.broadcast_to(np.asarray(width) / (self.cell * radius), radius.shape)
        level = np.clip(np.log2(np.maximum(size, 1e-9)), 0, len(self._levels) - 1)
        lower = level.astype(int)
        values = np.empty((len(radius), self._levels[0].shape[3]))
        for k in np.unique(lower):
            which = lower == k
            position = tuple(part[which] for part in place)
            fine = _trilinear(self._levels[k], position)
            if k + 1 < len(self._levels):
                fine = fine + (level[which] - k)[:, None] * (_trilinear(self._levels[k + 1], position) - fine)
            values[which] = fine
        if self.weighted:
            values = values[:, :-1] / np.maximum(values[:, -1:], 1e-300)
        return values if self.coloured else values[:, 0]


def _few_cells(shape: tuple[int, ...]) -> bool:
    return all(1 <= count <= _MOST_CELLS for count in shape)


def _checked_weights(weights: ArrayLike, shape: tuple[int, ...]) -> Float[Array, "i j k 1"]:
    share = numbers("weights", weights)
    if share.shape != shape:
        raise ValueError(f"Argument `weights` must have the shape {shape} of the grid, but has {share.shape}.")
    check_light("weights", share)
    return share[..., None]


def _halved(grid: Float[Array, "i j k channels"]) -> Float[Array, "_i _j _k channels"]:
    """Means of pairs along each axis; the last one of an odd number counts twice."""
    for axis in range(3):
        count = grid.shape[axis]
        if count > 1:
            pad = [(0, count % 2 if along == axis else 0) for along in range(4)]
            even = np.moveaxis(np.pad(grid, pad, mode="edge"), axis, 0)
            grid = np.moveaxis((even[::2] + even[1::2]) / 2, 0, axis)
    return grid


def _trilinear(grid: Float[Array, "i j k channels"], place: Sequence[Array]) -> Float[Array, "n channels"]:
    """Values (n, channels) at parts of the three axes; the last goes round."""
    first, second, part = [], [], []
    for axis, along in enumerate(place):
        count = grid.shape[axis]
        x = along * count - 0.5
        if axis < 2:
            x = np.clip(x, 0, count - 1)
        start = np.floor(x).astype(int)
        first.append(start % count)
        second.append((start + 1) % count if axis == 2 else np.minimum(start + 1, count - 1))
        part.append(x - start)
    flat, values = grid.reshape(-1, grid.shape[3]), np.zeros((len(place[0]), grid.shape[3]))
    # One azimuth is its own neighbour.
    if grid.shape[2] == 1:
        part[2] = np.zeros(len(part[2]))
    for corner in range(8 if grid.shape[2] > 1 else 4):
        ends = [(second if corner >> axis & 1 else first)[axis] for axis in range(3)]
        share = [part[axis] if corner >> axis & 1 else 1 - part[axis] for axis in range(3)]
        number = (ends[0] * grid.shape[1] + ends[1]) * grid.shape[2] + ends[2]
        values += (share[0] * share[1] * share[2])[:, None] * flat[number]
    return values


@dataclass(frozen=True, eq=False)
class Volume:
    """Matter between two radii that emits and absorbs as a black body.

    Parameters
    ----------
    density : float, function or VolumeGrid
        Optical depth per length (units of the mass) that the matter measures, the same for all frequencies. A function
        is called with radius, theta and azimuth.
    temperature : float, function or VolumeGrid
        Kelvin, likewise. A black body of 6504 K has luminance 1, and is white.
    inner, outer : float
        Radii of the ends of the matter, outside the horizon.
    scale : float
        Length over which density and temperature change, in units of the mass: rays are marched in steps of a part of
        it. A function needs one; grids have their cells, and numbers need none.
    motion : str or function
        "circular" (as prograde circular geodesics of the equatorial plane do at the distance r sin theta from the
        axis), "fiducial" (with the FIDO), "static" (at rest in Boyer-Lindquist coordinates), or dphi / dt itself, a
        function of radius and theta.
    brightness : float
        Factor of its light, for a sky in another unit: some hundred in front of a `StarField`.
    response : str or MeasuredResponse
        "cie", "film" or measured curves, as for `black_body`.
    colour : three numbers, function or VolumeGrid, optional
        Factors (n, 3) of the light at places, in linear sRGB: paint, as of a `Texture`; white if omitted.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    Where the motion is impossible, there is no matter. Matter without pressure cannot circle off the equatorial plane
    at constant theta: "circular" is a choice, not a solution.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.disks.Volume(0.1, 6504.0, inner=5.0, outer=8.0).motion
    'circular'
    """

    density: Any
    temperature: Any
    inner: float
    outer: float
    scale: float | None = None
    motion: str | Callable[[Array, Array], Any] = "circular"
    brightness: float = 1.0
    response: ResponseLike = "cie"
    colour: Any = None

    def __post_init__(self) -> None:
        """Raise ValueError unless the volume is valid."""
        check_rims(self.inner, self.outer)
        for name in ("density", "temperature"):
            value = getattr(self, name)
            if not (isinstance(value, VolumeGrid) or callable(value)):
                check_number(name, value, "be a finite number from 0 on, a function, or a VolumeGrid", not_negative)
        self._check_scale()
        if not (callable(self.motion) or (isinstance(self.motion, str) and self.motion in VOLUME_MOTIONS)):
            names = ", ".join(VOLUME_MOTIONS)
            raise ValueError(f"Argument `motion` must be one of {names}, or a function, but is {quoted(self.motion)}.")
        check_brightness(self.brightness)
        check_response(self.response)
        self._check_colours()

    def _check_colours(self) -> None:
        for name in ("density", "temperature", "colour"):
            law = getattr(self, name)
            if isinstance(law, VolumeGrid) and law.coloured != (name == "colour"):
                kind = "colours" if name == "colour" else "numbers"
                raise ValueError(f"Argument `{name}` must be a VolumeGrid of {kind}.")
        if not (self.colour is None or callable(self.colour) or isinstance(self.colour, VolumeGrid)):
            colour = numbers("colour", self.colour)
            if colour.shape != (3,):
                raise ValueError("Argument `colour` must be three numbers, a function, or a VolumeGrid of colours.")
            check_light("colour", colour)

    def _check_scale(self) -> None:
        if self.scale is None:
            if any(callable(law) for law in (self.density, self.temperature, self.colour)):
                raise ValueError("Argument `scale` must be given where density, temperature or colour is a function.")
        else:
            check_number("scale", self.scale, "be a positive, finite length", positive)

    def check(self, spin: float) -> None:
        """Raise ValueError for a volume that reaches the horizon of a hole."""
        check_above_horizon(self.inner, spin)

    @property
    def symmetric(self) -> bool:
        """True if it is known to be symmetric about the axis: numbers, grids with one azimuth, symmetric laws."""
        laws = self.density, self.temperature, self.colour
        return all(law.symmetric if isinstance(law, VolumeLaw) else not callable(law) for law in laws)

    @property
    def grids(self) -> tuple[VolumeGrid, ...]:
        """The laws that are grids: only grids depend on the width of beams."""
        return tuple(law for law in (self.density, self.temperature, self.colour) if isinstance(law, VolumeGrid))

    def length(self, radius: Float[Array, " n"], width: ArrayLike) -> Float[Array, " n"]:
        """Length (n,) over which something changes, for a beam of a width: no grid is finer than the beam."""
        length = np.full(radius.shape, self.outer if self.scale is None else float(self.scale))
        for grid in self.grids:
            length = np.minimum(length, np.maximum(grid.cell * radius, width))
        return length

    def matter(
        self, radius: Float[Array, " n"], theta: Float[Array, " n"], azimuth: Float[Array, " n"], width: ArrayLike
    ) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
        """Density and temperature (n,) at places, averaged over the width of a beam where they are grids."""
        place = radius, theta, azimuth, width
        return _values(self.density, "density", *place), _values(self.temperature, "temperature", *place)

    def tint(
        self, radius: Float[Array, " n"], theta: Float[Array, " n"], azimuth: Float[Array, " n"], width: ArrayLike
    ) -> Float[Array, "n 3"] | float:
        """Factors (n, 3) of the light at places, averaged over the width of a beam; 1 without a colour."""
        if self.colour is None:
            return 1.0
        if isinstance(self.colour, VolumeGrid):
            inside = (radius >= self.colour.inner) & (radius <= self.colour.outer)
            return self.colour.mean(radius, theta, azimuth, width) * inside[:, None]
        colour = self.colour(radius, theta, azimuth) if callable(self.colour) else self.colour
        values = real_array("colour", colour) + np.zeros((len(radius), 3))
        if not (np.isfinite(values).all() and (values >= 0).all()):
            raise ValueError("Argument `colour` must be a function whose values are finite and not negative.")
        return values

    def energy(
        self, spin: float, b: Float[Array, " n"], radius: Float[Array, " n"], theta: Float[Array, " n"]
    ) -> Float[Array, " n"]:
        """-p.u (n,) of photons of unit energy at infinity, as the matter measures; NaN where the motion is impossible.

        The matter circles: u = u^t (1, 0, 0, Omega), and u^t makes it a unit vector.
        """
        a, r = spin, radius
        c2, s2 = np.cos(theta) ** 2, np.sin(theta) ** 2
        sigma = r * r + a * a * c2
        big = (r * r + a * a) ** 2 - a * a * horizon_product(a, r) * s2
        orbital = self._orbital(spin, radius, theta, 2 * a * r / big)
        # -(g_tt + 2 Omega g_tphi + Omega^2 g_phiphi).
        slowness = 1 - 2 * r / sigma * (1 - a * s2 * orbital) ** 2 - (r * r + a * a) * s2 * orbital**2
        with np.errstate(invalid="ignore", divide="ignore"):
            return (1 - orbital * b) / np.sqrt(np.where(slowness > 0, slowness, np.nan))

    def _orbital(self, spin: float, radius: Array, theta: Array, shift: Array) -> Array:
        """Angular velocity dphi / dt (n,)."""
        if callable(self.motion):
            return real_array("motion", self.motion(radius, theta)) + np.zeros_like(radius)
        if self.motion == "circular":
            return 1 / (spin + np.abs(radius * np.sin(theta)) ** 1.5)
        return shift if self.motion == "fiducial" else np.zeros_like(radius)


def _values(law: Any, name: str, radius: Array, theta: Array, azimuth: Array, width: ArrayLike) -> Array:
    """Values (n,) of a number, a function or a grid."""
    if isinstance(law, VolumeGrid):
        inside = (radius >= law.inner) & (radius <= law.outer)
        return np.where(inside, law.mean(radius, theta, azimuth, width), 0.0)
    if not callable(law):
        return np.full(radius.shape, float(law))
    values = real_array(name, law(radius, theta, azimuth)) + np.zeros_like(radius)
    if not (np.isfinite(values).all() and (values >= 0).all()):
        raise ValueError(f"Argument `{name}` must be a function whose values are finite and not negative.")
    return values
