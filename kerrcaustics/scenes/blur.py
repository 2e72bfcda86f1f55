"""The motion blur of a picture: its kind, and the turn of its sky. No other module decides on these."""

from enum import Enum, auto
from typing import NamedTuple

from kerrcaustics.scenes.motion import BOX, ExposedMoment, Exposure, ShutterMotion, ShutterWeight
from kerrcaustics.scenes.sky import Sky


class BlurKind(Enum):
    """Kinds of motion blur, by the maps of the view that they need."""

    SKY = auto()
    """One map: the sky turns about the spin axis, or nothing moves."""
    MATTER = auto()
    """One map: the sky turns, and a disk or a volume is the mean of several moments."""
    CAMERA = auto()
    """Maps at several moments: the camera's view of the hole changes."""


class Blur(NamedTuple):
    """The motion blur of a picture.

    kind: its kind.
    exposure: the moments of the exposure; all of them are one for a picture without blur.
    """

    kind: BlurKind
    exposure: Exposure

    @property
    def camera_moves(self) -> bool:
        """True if the camera's view of the hole changes."""
        return self.kind is BlurKind.CAMERA

    @property
    def turn(self) -> float:
        """Angle (radians) by which the sky turns before one map; maps at several moments contain the turn."""
        return 0.0 if self.camera_moves else self.exposure.turn

    @property
    def moving_exposure(self) -> Exposure | None:
        """The exposure for maps at several moments; None for one map."""
        return self.exposure if self.camera_moves else None

    def pieces(self, count: int) -> "list[Blur]":
        """The blur in equal parts of the exposure, in order of time."""
        return [Blur(self.kind, piece) for piece in self.exposure.pieces(count)]


def blur_of(
    motion: ShutterMotion | None, middle: ExposedMoment, quality: str, sky: Sky | None, has_matter: bool
) -> Blur:
    """The blur of a picture.

    Parameters
    ----------
    motion : ShutterMotion, optional
    middle : ExposedMoment
        The moment in the middle of the exposure. Without motion, and in a draft, the picture shows it alone.
    quality : str
    sky : Sky, optional
        A sky without a sweep of its own unless one map serves the picture; else ValueError.
    has_matter : bool
        True if there is a disk or a volume.
    """
    # Raises ValueError for an invalid motion, also in a draft.
    exposure = None if motion is None else motion.exposure(middle)
    if exposure is None or quality == "draft":
        return Blur(BlurKind.SKY, Exposure(middle, middle, middle))
    at_rest = BlurKind.MATTER if has_matter else BlurKind.SKY
    kind = at_rest if exposure.keeps_view else BlurKind.CAMERA
    if kind is not BlurKind.SKY and sky is not None and sky.sweep:
        raise ValueError("Argument `sky` must have no `sweep` of its own where `motion` is given.")
    return Blur(kind, exposure)


class SkyTurn(NamedTuple):
    """The turn of a sky about the spin axis during an exposure, half of it on either side of the middle.

    spread: angle by which its spread light turns, radians; 0 for light so smooth that no blur shows.
    points: angle by which its points of light turn, radians.
    weight: weight of the moments.
    """

    spread: float
    points: float
    weight: ShutterWeight


def sky_turn(sky: Sky, angle: float = 0.0, weight: ShutterWeight = BOX) -> SkyTurn:
    """The turn of a sky that turns by its own sweep and by an angle, radians."""
    points = angle + sky.sweep
    return SkyTurn(0.0 if sky.smooth else points, points, weight)
