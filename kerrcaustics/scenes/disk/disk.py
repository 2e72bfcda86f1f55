"""Thin disks: their rims, emission, opacity and motion."""

from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np

from kerrcaustics.beams.emitters import EMITTERS
from kerrcaustics.scenes.disk.samples import DiskSamples, Emission
from kerrcaustics.scenes.disk.texture import AlphaOpacity
from kerrcaustics.scenes.scene_checks import check_above_horizon, check_brightness, check_number, check_rims, positive
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import flags, instance_of, one_of, quoted, real_array
from kerrcaustics.spacetime.kerr import isco
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

DiskMotion = Literal["circular", "retrograde", "static", "plunging", "retrograde-plunging"]
MOTIONS: tuple[DiskMotion, ...] = get_args(DiskMotion)

OPPOSITE: dict[str, DiskMotion] = {
    "circular": "retrograde",
    "retrograde": "circular",
    "static": "static",
    "plunging": "retrograde-plunging",
    "retrograde-plunging": "plunging",
}
"""The motion in the opposite sense for each motion."""


def is_prograde(motion: str) -> bool:
    """True unless the matter circles against the rotation of the hole."""
    return not motion.startswith("retrograde")


def inner_rim(inner: Any, motion: str, spin: float) -> Any:
    """The inner rim of a disk about a hole: for "isco", the radius of the innermost stable orbit in its sense."""
    return isco(spin, is_prograde(motion)) if _is_isco(inner) else inner


def disk_about(disk: Any, viewer: Any) -> Any:
    """A disk with its rims as numbers, about the hole of a viewer; anything else unchanged."""
    if not (isinstance(disk, Disk) and _is_isco(disk.inner) and isinstance(viewer, Viewer)):
        return disk
    opacity = None if isinstance(disk.opacity, AlphaOpacity) else disk.opacity
    return replace(disk, inner=inner_rim(disk.inner, disk.motion, viewer.spin), opacity=opacity)


def check_disk(disk: Any, spin: float) -> None:
    """Raise ValueError unless there is a disk, outside the horizon of a hole."""
    instance_of("disk", disk, Disk)
    disk.check(spin)


def outer_rim(disk: Any) -> float:
    """The radius of the outer rim; 0 for no disk."""
    return disk.outer if isinstance(disk, Disk) else 0.0


def _is_isco(inner: Any) -> bool:
    return isinstance(inner, str) and inner == "isco"


@dataclass(frozen=True, eq=False)
class Disk:
    """An infinitely thin disk in the equatorial plane.

    Parameters
    ----------
    inner, outer : float or "isco"
        Radii of its rims, outside the horizon. inner may be "isco", the innermost stable circular orbit about the hole
        of the picture: the retrograde orbit for retrograde motions, else the prograde one.
    emission : Emission
        The light that it emits, the same on both faces: `BlackBody`, `PowerLaw`, `PageThorne`, `Swatches`, `Texture`,
        `Spots`, `Wisps`, `FunctionEmission`, or a class of your own.
    opacity : float or function
        The part of the light behind that the disk blocks when seen along its axis, 0 to 1: 1 - exp(-tau). It does not
        affect the emission: a transparent disk emits as well. If omitted, 1, or the alpha of a `Texture`.
    motion : str
        Motion of the matter, for the shifts of frequency and for the motion of the pattern: "circular" (prograde
        circular geodesics), "retrograde", "static" (at rest in Boyer-Lindquist coordinates), "plunging" (circular down
        to the ISCO, and from there falling with its energy and angular momentum), "retrograde-plunging".
    slant : bool
        True if slanting light has a longer path through the disk, by 1 / cos i with the angle i that its matter
        measures. If omitted, true, except for the alpha of a `Texture`, whose holes are holes from all sides.
    brightness : float
        Factor of its light, for a sky in another unit: some hundred in front of a `StarField`.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    If the motion is impossible at a radius (circular geodesics at or within the photon orbit), the disk is dark there
    in pictures with shifted light.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> disk = kc.disks.Disk(inner=9.26, outer=18.70, emission=kc.disks.BlackBody(4500))
    >>> disk.opaque
    True
    """

    inner: Any
    outer: float
    emission: Emission
    opacity: Any = None
    motion: str = "circular"
    slant: bool | None = None
    brightness: float = 1.0

    def __post_init__(self) -> None:
        """Raise ValueError unless the disk is valid."""
        if _is_isco(self.inner):
            check_number("outer", self.outer, "be a positive, finite radius", positive)
        else:
            check_rims(self.inner, self.outer)
        if not isinstance(self.emission, Emission):
            raise ValueError(
                f"Argument `emission` must be a `kerrcaustics.disks.Emission`, but is {quoted(self.emission)}."
            )
        self._complete()
        if not callable(self.opacity):
            must = "be a number from 0 to 1, or a function"
            check_number("opacity", self.opacity, must, lambda part: 0 <= part <= 1)
        check_brightness(self.brightness)
        one_of("motion", self.motion, MOTIONS)

    def _complete(self) -> None:
        """Fill in opacity and slant."""
        if self.slant is not None:
            flags(slant=self.slant)
        opacity, slant = self.opacity, True if self.slant is None else self.slant
        if opacity is None:
            opacity = self.emission.own_opacity(self.inner, self.outer)
            if opacity is None:
                opacity = 1.0
            else:
                slant = bool(self.slant)
        object.__setattr__(self, "opacity", opacity)
        object.__setattr__(self, "slant", slant)

    def check(self, spin: float) -> None:
        """Raise ValueError for a disk that reaches the horizon of a hole."""
        check_above_horizon(inner_rim(self.inner, self.motion, spin), spin)

    @property
    def opaque(self) -> bool:
        """True if the disk hides everything behind it."""
        return not callable(self.opacity) and self.opacity == 1

    @property
    def slanting(self) -> bool:
        """True if the slant of light matters."""
        return bool(self.slant) and (callable(self.opacity) or 0 < self.opacity < 1)

    def orbital(self, spin: float, radius: Array) -> Array:
        """dphi / dt (n,) at radii; 0 where the motion is impossible."""
        return orbital(self.motion, spin, radius)

    def opacity_at(self, radius: Float[Array, " n"], azimuth: Float[Array, " n"]) -> Float[Array, " n"]:
        """The part (n,) of the light behind that is blocked when seen along the axis."""
        if not callable(self.opacity):
            return np.full(len(radius), float(self.opacity))
        opacity = real_array("opacity", self.opacity(radius, azimuth)) + np.zeros_like(radius)
        if not (np.isfinite(opacity) & (opacity >= 0) & (opacity <= 1)).all():
            raise ValueError("Argument `opacity` must be a function whose values lie in 0 to 1.")
        return opacity

    def transmitted(self, samples: DiskSamples, cosine: Float[Array, " n"]) -> Float[Array, " n"]:
        """The part (n,) of the light behind that comes through; cosine, of the angle from the axis."""
        if isinstance(self.opacity, AlphaOpacity):
            opacity = real_array("opacity", self.opacity.mean(samples))
        else:
            opacity = self.opacity_at(samples.radius, samples.azimuth)
        if not self.slanting:
            return 1 - opacity
        with np.errstate(divide="ignore", invalid="ignore"):
            # If the motion is impossible, the light counts as along the axis.
            return np.exp(np.log1p(-opacity) / np.where(np.isfinite(cosine), np.clip(cosine, 1e-6, 1), 1.0))


def orbital(motion: str, spin: float, radius: Array) -> Array:
    """dphi / dt (n,) of matter at radii for a motion; 0 where the motion is impossible."""
    return np.nan_to_num(np.asarray(EMITTERS[motion](spin, radius, 0.0).orbital) + np.zeros_like(radius))
