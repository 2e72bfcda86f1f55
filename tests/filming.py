"""Helpers of the tests of films: a scene that costs nothing, with the protocol of those that scene files describe."""

import json
import os
import signal
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class MovingBar:
    """A bright bar on noise that moves to the right; each frame takes a while, fails or kills its process if wanted."""

    frames: int = 12
    rate: int = 25
    speed: int = 6
    pause: float = 0.0
    fails: tuple[int, ...] = ()
    kills: tuple[int, ...] = ()
    size: tuple[int, int] = (96, 48)
    name: str = "bar.toml"
    remarks: tuple[str, ...] = ()
    drawn: list[int] = field(default_factory=list)

    def resized(self, width: int, height: int) -> "MovingBar":
        return replace(self, size=(width, height))

    def with_exposures(self) -> "MovingBar":
        return self

    def record(self) -> dict:
        return {"speed": self.speed, "frames": self.frames, "size": list(self.size), "camera": [{"radius": 6.0}]}

    def picture(self, number: int, *, quality: str | None = None, scale: float = 1.0) -> np.ndarray:
        self.drawn.append(number)
        time.sleep(self.pause)
        if number in self.kills:
            os.kill(os.getpid(), signal.SIGKILL)
        if number in self.fails:
            raise RuntimeError(f"the sky\nis falling on {number}")
        width, height = self.size
        picture = np.random.default_rng([number, len(quality or "normal")]).integers(
            0, 90, (height, width, 3), np.uint8
        )
        left = self.speed * number % width
        picture[:, left : left + 8] = 250
        return picture


def read_bar(path) -> MovingBar:
    """A bar as a file says: what dataclass fields are, in JSON."""
    said = json.loads(Path(path).read_text())
    return MovingBar(**{key: tuple(value) if isinstance(value, list) else value for key, value in said.items()})
