"""Options for the size of pictures and films of scene files."""

import re
from dataclasses import dataclass
from typing import Any

import cyclopts

from kerrcaustics.cli.endings import BadInput

_LARGEST_SCALE = 16


@cyclopts.Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class SizeOptions:
    """The size of the picture.

    Attributes
    ----------
    size
        WIDTHxHEIGHT, such as 640x360: size of the picture in pixels, instead of that of the scene.
    scale
        Factor for the width and the height of the scene, such as 0.5. A film's width and height are rounded to even
        numbers.
    """

    size: str | None = None
    scale: float | None = None

    def check(self, even: bool = False) -> None:
        """Refuse both, and what is no size; even: of a film."""
        if self.size is not None and self.scale is not None:
            raise BadInput("Arguments --size and --scale: only one of them can be given.")
        if self.scale is not None and not 0 < self.scale <= _LARGEST_SCALE:
            raise BadInput(f"Argument --scale must be above 0 and at most {_LARGEST_SCALE}, but is {self.scale:g}.")
        if self.size is None:
            return
        match = re.fullmatch(r"([1-9]\d{0,5})x([1-9]\d{0,5})", self.size)
        if match is None:
            raise BadInput(f"Argument --size must be WIDTHxHEIGHT in pixels, such as 640x360, but is {self.size}.")
        if even and any(int(pixels) % 2 for pixels in match.groups()):
            raise BadInput(f"Argument --size must have an even width and height for a film, but is {self.size}.")

    def applied(self, scene: Any, even: bool = False) -> Any:
        """The scene (`FilmedScene`) in this size; even: with lengths that a film can have."""
        if self.size is not None:
            width, height = map(int, self.size.split("x"))
            return scene.resized(width, height)
        if self.scale is None:
            return scene
        step = 2 if even else 1
        width, height = (max(round(self.scale * pixels / step), 1) * step for pixels in scene.size)
        return scene.resized(width, height)


AS_IT_IS = SizeOptions()
"""The size of the scene."""
