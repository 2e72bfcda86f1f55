"""Frames: pixels against the light of very many rays each."""

import math
from collections.abc import Iterator
from functools import partial

import numpy as np
from scipy.ndimage import gaussian_filter

import kerrcaustics as kc
from kerrcaustics.scenes.footprint import Footprint

from .points import Measured, Result, Sizes, nothing

Array = np.ndarray

CAMERA, FIELD = kc.Camera(0.999, 6.03), math.radians(150)
SKY = kc.skies.Checkerboard(15, 30)
QUALITIES = ("draft", "normal", "high")
# Rays across a pixel of other tracers, and the deviation of the filter of ours, in pixels.
SIDES, FILTER = (1, 2, 4), 0.5
# Pixels next to the border are left out, as the filter reaches beyond it.
_BORDER = 4
_CHANNEL = 1
_AT_ONCE = 500_000


def view_of(sizes: Sizes) -> kc.pictures.View:
    """The view of the frames, 16 to 9."""
    return kc.pictures.View(sizes.pixels * 16 // 9, sizes.pixels, FIELD, "fisheye")


def light_of_rays(view: kc.pictures.View, side: int) -> Array:
    """Light at side x side places of each pixel, one ray each: (side height, side width)."""
    part = (np.arange(side) + 0.5) / side - 0.5
    y, x = ((np.arange(size)[:, None] + part).ravel() for size in (view.height, view.width))
    light = np.zeros((len(y), len(x)))
    # Some at a time, as all rays together would need gigabytes.
    for rows in np.array_split(np.arange(len(y)), math.ceil(light.size / _AT_ONCE)):
        grid_y, grid_x = np.meshgrid(y[rows], x, indexing="ij")
        rays = kc.trace_rays(CAMERA, view.directions(grid_x.ravel(), grid_y.ravel())[0])
        seen = np.isfinite(rays.direction[:, 0])
        count = int(seen.sum())
        axes = np.broadcast_to(1e-9 * np.eye(2), (count, 2, 2))
        footprint = Footprint(rays.direction[seen], axes, np.zeros(count), np.ones(count))
        values = np.zeros(len(seen))
        values[seen] = SKY.light(footprint, False, False)[:, _CHANNEL]
        light[rows] = values.reshape(grid_y.shape)
    return light


def square_means(light: Array, side: int) -> Array:
    """Means over the squares of pixels."""
    height, width = (size // side for size in light.shape)
    return light.reshape(height, side, width, side).mean(axis=(1, 3))


def frames(sizes: Sizes) -> Iterator[Measured]:
    """Pixels as they are rendered, with the filter of the program."""
    view, side = view_of(sizes), sizes.side
    # A place in the middle of each pixel, as the number across is odd.
    true = gaussian_filter(light_of_rays(view, side), FILTER * side, truncate=5)[side // 2 :: side, side // 2 :: side]
    for quality in QUALITIES:
        light = kc.render(CAMERA, view, SKY, quality=quality).light[..., _CHANNEL]
        yield _frame(quality, partial(kc.render, CAMERA, view, SKY, quality=quality), light, true)


def rays_in_pixels(sizes: Sizes) -> Iterator[Measured]:
    """Pixels as means over rays, as older tracers have them."""
    view = view_of(sizes)
    true = square_means(light_of_rays(view, sizes.side), sizes.side)
    for side in SIDES:
        light = square_means(light_of_rays(view, side), side)
        yield _frame(f"{side * side} a pixel", partial(light_of_rays, view, side), light, true)


def _frame(setting: str, work: "partial", light: Array, true: Array) -> Measured:
    """The root of the mean square of the difference, relative to the mean of the light."""
    inner = slice(_BORDER, -_BORDER)
    off = math.sqrt(((light - true)[inner, inner] ** 2).mean()) / true.mean()
    return Measured(setting, work, np.array([off]), nothing(1))


_MANY = "many rays a pixel"
RESULTS = (
    Result("pictures", "frame", "light of a pixel, rms", _MANY, frames),
    Result("pictures", "frame of rays alone", "light of a pixel, rms", _MANY, rays_in_pixels),
)
"""Results of this module."""
