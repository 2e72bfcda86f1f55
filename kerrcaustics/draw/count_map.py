"""Picture of the image counts over the celestial sphere, with the caustics on it."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MultipleLocator

from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.plots import headline
from kerrcaustics.stars.counts import CountMap

_HALO = withStroke(linewidth=3, foreground="white")
# Caustics below this extent, radians, are ringed.
_SMALL = math.radians(4.0)
# From the borders of the picture, degrees.
_AWAY = 1e-9
# Light enough for the lines of caustics on top.
_COLOURS = ("YlGnBu", 0.0, 0.66)


def count_map_axes(ax: Axes, counts: CountMap, caustics: CausticSet) -> Axes:
    """Total image counts over the celestial sphere, one colour a count, and the caustics, in degrees.

    Parameters
    ----------
    ax : Axes
        Where to draw; a colour bar is put beside it.
    counts : CountMap
        What `count_map` returned.
    caustics : CausticSet
        Of the same camera; drawn wrapped into phi' of -180 to 180 degrees. theta' is 0 at the top.
    """
    total = counts.counts.sum(axis=2)
    seen = np.unique(total)
    name, low, high = _COLOURS
    colours = ListedColormap(colormaps[name](np.linspace(low, high, len(seen))))
    edges = np.arange(len(seen) + 1) - 0.5
    # Columns run from phi' = 0; the picture from -180.
    picture = np.searchsorted(seen, np.roll(total, total.shape[1] // 2, axis=1))
    image = ax.imshow(
        picture, extent=(-180, 180, 180, 0), cmap=colours, norm=BoundaryNorm(edges, len(seen)), interpolation="nearest"
    )
    bar = ax.figure.colorbar(image, ax=ax, ticks=np.arange(len(seen)), fraction=0.03, pad=0.02)
    bar.ax.set_yticklabels([str(count) for count in seen])
    bar.ax.tick_params(length=0)
    bar.ax.minorticks_off()
    bar.set_label(f"images of index 0 to {counts.counts.shape[2] - 1}")
    for caustic in caustics:
        if caustic.kind == "point":
            style.draw_cross(ax, wrapped(np.degrees(caustic.celestial[:1]))[0], caustic.order)
            continue
        line = wrapped(np.degrees(caustic.celestial[np.append(np.arange(len(caustic.celestial)), 0)]))
        if max(caustic.theta_extent, caustic.phi_extent) < _SMALL:
            # Too small to be seen: a ring round it.
            middle = np.degrees(caustic.celestial.mean(axis=0, keepdims=True))
            ring: dict[str, Any] = {"marker": "o", "markersize": 9, "markerfacecolor": "none", "linestyle": "none"}
            ax.plot(*wrapped(middle).T, color=style.order_colour(caustic.order), path_effects=[_HALO], **ring)
        settings: dict[str, Any] = style.order_line(caustic.order)
        width = 1.1 if caustic.circuits < 2 else 0.7
        ax.plot(*line.T, label=style.order_name(caustic.order), linewidth=width, **settings)
    ax.set_xlim(-180, 180)
    ax.set_ylim(180, 0)
    ax.xaxis.set_major_locator(MultipleLocator(60))
    ax.yaxis.set_major_locator(MultipleLocator(30))
    ax.set_xlabel("φ′ (deg)")
    ax.set_ylabel("θ′ (deg)")
    return ax


def count_map_figure(counts: CountMap, caustics: CausticSet) -> Figure:
    """Figure of `count_map_axes`, 7 inches wide, with the camera in its title."""
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 4.1), layout="constrained")
        ax = count_map_axes(figure.add_subplot(), counts, caustics)
        handles, labels = ax.get_legend_handles_labels()
        labels = [f"{label} caustic" for label in labels]
        figure.legend(handles, labels, loc="outside lower center", ncols=min(len(handles), 4))
        figure.suptitle(headline(caustics))
    return figure


def wrapped(celestial: np.ndarray) -> np.ndarray:
    """Line (m, 2) of phi' in [-180, 180] and theta', degrees, of a curve (n, 2) of theta' and unwrapped phi'.

    Where it leaves the picture on one side it is led to the border, broken, and begun again on the other.
    """
    pieces = []
    # A point on the border itself belongs to the side of larger phi'.
    on_border = (celestial[:, 1] + 180) % 360 == 0
    celestial = np.stack([celestial[:, 0], celestial[:, 1] + np.where(on_border, _AWAY, 0.0)], axis=-1)
    for start, end in pairwise(celestial):
        pieces.append(start)
        low, high = sorted((start[1], end[1]))
        for border in range(math.ceil((low + 180) / 360), math.floor((high + 180) / 360) + 1):
            phi = 360.0 * border - 180
            part = (phi - start[1]) / (end[1] - start[1]) if end[1] != start[1] else 0.0
            theta = start[0] + part * (end[0] - start[0])
            side = 1 if end[1] > start[1] else -1
            pieces += [(theta, phi - side * _AWAY), (math.nan, math.nan), (theta, phi + side * _AWAY)]
    pieces.append(celestial[-1])
    theta, phi = np.array(pieces).T
    return np.stack([(phi + 180) % 360 - 180, theta], axis=-1)
