"""Films of scene files: the protocol of a filmed scene, and its frames."""

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from kerrcaustics.films.film import Film
from kerrcaustics.shapes import UInt8

Array = np.ndarray


@runtime_checkable
class FilmedScene(Protocol):
    """A scene over time that can be drawn, and pickled."""

    @property
    def name(self) -> str:
        """The name of its file."""
        ...

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        ...

    @property
    def frames(self) -> int:
        """Number of frames."""
        ...

    @property
    def rate(self) -> int:
        """Frames a second."""
        ...

    @property
    def remarks(self) -> tuple[str, ...]:
        """Lines on what the author may not have meant."""
        ...

    def resized(self, width: int, height: int) -> "FilmedScene":
        """The same scene in another size, pixels."""
        ...

    def record(self) -> dict[str, Any]:
        """The settings on which the frames depend, as JSON holds them."""
        ...

    def with_exposures(self) -> "FilmedScene":
        """The scene with all that its frames have in common worked out, before other processes draw them."""
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
    _check_size(scene)
    settings = {"quality": quality or getattr(scene, "quality", "normal"), "scene": scene.record()}
    return Film("scene", settings, scene.frames, scene.rate, SceneFrames(scene, quality))


def _check_size(scene: FilmedScene) -> None:
    """Raise ValueError for frames that no film holds: H.264 halves the colours' height and width."""
    for key, pixels in zip(("view.width", "view.height"), scene.size, strict=True):
        if pixels % 2:
            raise ValueError(f"Scene {scene.name}: {key} must be even for a film, but is {pixels}.")
