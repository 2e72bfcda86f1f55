"""Error against run time of line profiles: beams at nodes, and a histogram of rays."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import kerrcaustics as kc
from kerrcaustics.scenes.disk.emission import page_thorne_flux

from . import screen
from .light import last_orbit

Array = np.ndarray

DISTANCE, SPIN, INCLINATION = 1e6, 0.9, 60.0
METHODS = ("beams at nodes", "histogram of rays")


@dataclass(frozen=True)
class Case:
    """A disk, with an emissivity and bins."""

    name: str
    inner: float
    outer: float
    law: Callable[[Array], Array]
    bins: Array

    def profile(self, radii: int, turns: int) -> kc.disks.LineProfile:
        """From beams at nodes."""
        camera = screen.observer(SPIN, INCLINATION, DISTANCE)
        disk = self.inner, self.outer, self.law
        return kc.line_profile(camera, *disk, bins=self.bins, radii=radii, turns=turns)

    def histogram(self, side: int) -> Array:
        """From the rays of a picture of side x side pixels."""
        camera = screen.observer(SPIN, INCLINATION, DISTANCE)
        half = (self.outer + 4) / DISTANCE
        step = ((np.arange(side) + 0.5) / side * 2 - 1) * half
        x, y = (part.ravel() for part in np.meshgrid(step, step))
        sky = np.stack([-np.ones_like(x), x, y], axis=-1)
        rays = kc.trace_rays(camera, sky, end=kc.EquatorialPlane(1), redshift=True)
        assert rays.radius is not None and rays.redshift is not None
        on = (rays.radius >= self.inner) & (rays.radius <= self.outer)
        light = rays.redshift[on] ** 4 * self.law(rays.radius[on]) * (2 * half / side) ** 2
        return np.histogram(rays.redshift[on], self.bins, weights=light)[0]


def cases() -> tuple[Case, Case]:
    """A ring, and a disk of Page & Thorne."""
    last = last_orbit(SPIN)
    return (
        Case("ring, 6 to 6.6", 6.0, 6.6, lambda r: r**-3.0, np.linspace(0.55, 1.2, 66)),
        Case("Page & Thorne, ISCO to 30", last, 30.0, lambda r: page_thorne_flux(SPIN, r), np.linspace(0.1, 1.4, 131)),
    )


@dataclass(frozen=True)
class Work:
    """A setting: rays, seconds, and the largest error of a bin, true and reported, over the highest bin."""

    case: str
    method: str
    rays: int
    seconds: float
    error: float
    reported: float


def measured(
    case: Case, nodes: tuple[tuple[int, int], ...], sides: tuple[int, ...], finest: tuple[int, int], rounds: int
) -> list[Work]:
    """Errors against the finest profile; times are the least of some rounds, in which settings take turns."""
    best = case.profile(*finest).flux
    settings = [(METHODS[0], pair) for pair in nodes] + [(METHODS[1], (side,)) for side in sides]
    seconds, answers = np.full((rounds + 1, len(settings)), math.inf), [None] * len(settings)
    for turn in range(rounds + 1):
        for i, (method, size) in enumerate(settings):
            work = case.profile if method == METHODS[0] else case.histogram
            began = time.perf_counter()
            answers[i] = work(*size)
            # The first round loads.
            seconds[turn, i] = time.perf_counter() - began if turn else math.inf
    found = []
    for (method, size), least, answer in zip(settings, seconds.min(axis=0), answers, strict=True):
        known = isinstance(answer, kc.disks.LineProfile)
        flux, rays = (answer.flux, answer.rays) if known else (answer, size[0] ** 2)
        reported = float(answer.error.max() / best.max()) if known else math.nan
        miss = float(np.abs(flux - best).max() / best.max())
        found.append(Work(case.name, method, rays, float(least), miss, reported))
    return found
