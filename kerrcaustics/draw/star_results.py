"""Plots of stars on the celestial sphere, of a catalogue and of a field."""

import numpy as np
from matplotlib.axes import Axes

from kerrcaustics.beams.ends import SKY
from kerrcaustics.draw.sky_axes import celestial_sphere_axes, on_axes
from kerrcaustics.scenes.catalogue import StarCatalogue
from kerrcaustics.scenes.star_field import StarField
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.sphere import polar_angle

Array = np.ndarray


def catalogue(ax: Axes, catalogue: StarCatalogue, *, brightest: int = 3000) -> Axes:
    """The brightest stars, bright ones larger, in the catalogue's own directions; `brightest`: how many."""
    return _stars(ax, catalogue, np.eye(3), brightest)


def star_field(ax: Axes, field: StarField, *, brightest: int = 3000) -> Axes:
    """The brightest stars on the celestial sphere, bright ones larger; `brightest`: how many."""
    return _stars(ax, field.catalogue, np.asarray(field.orientation, float), brightest)


def _stars(ax: Axes, catalogue: StarCatalogue, orientation: Float[Array, "3 3"], brightest: int) -> Axes:
    chosen = np.argsort(catalogue.magnitude)[:brightest]
    direction = catalogue.direction[chosen] @ orientation.T
    places = np.stack([polar_angle(direction), np.arctan2(direction[:, 1], direction[:, 0])], axis=-1)
    size = 10 ** (-0.2 * (catalogue.magnitude[chosen] - 2)) * 6
    celestial_sphere_axes(ax).scatter(*on_axes(ax, SKY, places), s=size, color="black", linewidths=0)
    return ax
