"""
A star that is no point
=======================

A star of 3 degrees passes behind a hole without spin, seen from r = 10: its images stretch, touch, become Einstein's
ring, and part. Then one of 1 degree enters the secondary caustic of a hole of spin 0.999, seen from r = 6.03 (JTFT,
fig 6: θ′ = 0.392 π): a shape grows out of the secondary critical curve, along which the view is unrolled, and parts in
two. Left the images, right the light of all of them up to index 2.
"""

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.films import Film, blank_frame, pixels
from kerrcaustics.draw.sky_results import labelled_once
from kerrcaustics.draw.source_images import source_images, unrolled_images
from kerrcaustics.extended_sources.magnification import Magnification

STILL, RING_STAR, FARTHEST = kc.Camera(spin=0.0, radius=10.0, velocity="fiducial"), math.radians(3.0), 14.0
FAST, THETA, STAR, DEPTHS = kc.Camera(spin=0.999, radius=6.03), 0.392 * math.pi, math.radians(1.0), (-2.0, 4.0)
MAX_INDEX = 2

_CURVE_POINTS = 81


def film(frames: int = 360) -> Film:
    first = frames // 2
    scenes = (_ring(), first), (_entrance(), frames - first)

    def draw(number: int) -> np.ndarray:
        (scene, count), now = (scenes[0], number) if number < first else (scenes[1], number - first)
        return scene.frame(now / max(count - 1, 1))

    return Film("finite_star", {"ring star": RING_STAR, "star": STAR, "theta": THETA}, frames, 24, draw)


class _Scene:
    """A star on its way, its images, and its light; places on the way go from 0 to 1."""

    def __init__(
        self,
        title: str,
        light_axis: tuple[str, np.ndarray],
        seen: Callable[[float], Magnification],
        show: Callable[[Axes, Magnification], object],
    ) -> None:
        """light_axis: the name of the place on the way, and its first and last value."""
        self._title, (self._name, self._ends), self._seen, self._show = title, light_axis, seen, show

    @cached_property
    def _light(self) -> tuple[np.ndarray, np.ndarray]:
        at = np.linspace(0, 1, _CURVE_POINTS)
        return np.interp(at, (0, 1), self._ends), np.array([self._seen(place).total for place in at.tolist()])

    def frame(self, place: float) -> np.ndarray:
        """The picture for a place."""
        seen = self._seen(place)
        with rc_context(style.FILM_RC):
            figure = blank_frame()
            left, right = figure.subplots(1, 2)
            figure.subplots_adjust(left=0.07, right=0.97, bottom=0.22, top=0.87, wspace=0.2)
            self._show(left, seen)
            right.plot(*self._light, color=style.PALETTE[0])
            right.plot(np.interp(place, (0, 1), self._ends), seen.total, "o", color=style.PALETTE[1])
            right.set(xlabel=self._name, ylabel="magnification", xlim=self._ends, title="light")
            figure.suptitle(self._title, fontsize=15)
            return pixels(figure)


def _ring() -> _Scene:
    """The star of 3 degrees, on its way through the axis of the hole without spin."""
    caustics = kc.caustics(STILL, orders=MAX_INDEX + 1)
    ends = np.array([-FARTHEST, FARTHEST])

    def show(ax: Axes, seen: Magnification) -> None:
        source_images(ax, seen, caustics=caustics)
        ax.set(xlim=(-62, 62), ylim=(-62, 62), aspect="equal", xlabel="deg", ylabel="deg", title="camera sky")
        labelled_once(ax, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3)

    return _Scene(
        "A star of 3 deg behind a hole without spin, r = 10 M",
        ("degrees from the axis", ends),
        lambda at: kc.magnification(
            STILL, (math.pi / 2, math.pi - math.radians(np.interp(at, (0, 1), ends))), RING_STAR, max_index=MAX_INDEX
        ),
        show,
    )


def _entrance() -> _Scene:
    """The star of 1 degree, on its way into the secondary caustic."""
    critical = kc.caustics(FAST, orders=2)[1]
    event = next(event for event in kc.pair_events(FAST, THETA) if event.kind == "creation")

    def show(ax: Axes, seen: Magnification) -> None:
        unrolled_images(ax, seen, critical, event.sky)
        ax.set(xlim=(-36, 36), ylim=(-0.35, 0.35), title="images at the secondary critical curve, unrolled")
        ax.set(xlabel="position angle from the fold (deg)", ylabel="deg from the critical curve")

    return _Scene(
        "A star of 1 deg enters the secondary caustic: a = 0.999, r = 6.03 M",
        ("radii of the star within the caustic", np.array(DEPTHS)),
        lambda at: kc.magnification(
            FAST, (THETA, event.star[1] - np.interp(at, (0, 1), DEPTHS) * STAR), STAR, max_index=MAX_INDEX
        ),
        show,
    )
