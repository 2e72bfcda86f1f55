"""What tables of scene files share: their base, and the values of their keys."""

from typing import Annotated

import msgspec
from msgspec import Meta

from kerrcaustics.scenes.raster import MOST_PIXELS

Vector = tuple[float, float, float]
Inclination = Annotated[float, Meta(ge=0, le=180, description="degrees")]
PixelCount = Annotated[int, Meta(ge=1, le=MOST_PIXELS)]
Count = Annotated[int, Meta(ge=1, le=1_000_000)]
Seed = Annotated[int, Meta(ge=0)]


class SceneTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """A table of a scene file."""


class ValueAt(SceneTable, kw_only=True, frozen=True):
    """A value at a time.

    time: the time.
    value: the value then.
    """

    time: float
    value: float


Varied = float | str | tuple[ValueAt, ...]
"""A number, an expression of t, or values at times, which a spline joins."""


class GridTable(SceneTable, kw_only=True, frozen=True):
    """Numbers in a file: a grid in space, an array in a .npy file, or curves in a text file.

    file: name of the file.
    """

    file: str
