"""Films of scene files: what a scene must be able to do, and its frames."""

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import UInt8

from kerrcaustics.films.film import Film

Array = np.ndarray


@runtime_checkable
class FilmedScene(Protocol):
    """A scene over time that can be drawn, and pickled."""

    @property
    def frames(self) -> int:
        """How many frames."""
        ...

    @property
    def rate(self) -> int:
        """Frames a second."""
        ...

    def record(self) -> dict[str, Any]:
        """Everything that the frames depend on, as JSON holds it."""
        ...

    def picture(self, number: int, *, quality: str | None = None, scale: float = 1.0) -> UInt8[Array, "height width 3"]:
        """The picture (height, width, 3) of a frame."""
        ...


@dataclass(frozen=True)
class SceneFrames:
    """The frames of a scene at one quality: a function that can be sent to workers."""

    scene: FilmedScene
    quality: str | None

    def __call__(self, number: int) -> UInt8[Array, "height width 3"]:
        """The picture (height, width, 3) of a frame."""
        return self.scene.picture(number, quality=self.quality)


def scene_film(scene: FilmedScene, quality: str | None = None) -> Film:
    """The film of a scene, at the quality "draft", "normal" or "high", or that which the scene itself says."""
    settings = {"quality": quality or getattr(scene, "quality", "normal"), "scene": scene.record()}
    return Film("scene", settings, scene.frames, scene.rate, SceneFrames(scene, quality))
