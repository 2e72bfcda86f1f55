"""Picture of the image counts over the celestial sphere, with the caustics on it."""

import math

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from kerrcaustics.curves.caustic import Caustic, CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.plane_maps import plane_count_map_figure
from kerrcaustics.draw.plots import headline
from kerrcaustics.draw.sky_axes import celestial_sphere_axes, draw_wrapped, wrapped
from kerrcaustics.stars.counts import CountMap

_HALO = withStroke(linewidth=3, foreground="white")
# Caustics below this extent, radians, are pointed out.
_SMALL = math.radians(4.0)
# Light enough for the lines of caustics on top.
_COLOURS = ("YlGnBu", 0.0, 0.66)


def count_map_axes(ax: Axes, counts: CountMap, caustics: CausticSet | tuple[Caustic, ...] = (), most: int = 0) -> Axes:
    """Total image counts over the celestial sphere, one colour a count, and the caustics, in degrees.

    Parameters
    ----------
    ax : Axes
        Where to draw; a colour bar is put beside it.
    counts : CountMap
        What `count_map` returned.
    caustics : CausticSet, optional
        Of the same camera; drawn wrapped into phi' of -180 to 180 degrees. theta' is 0 at the top.
    most : int
        Highest count of the colour bar, where the map's own is lower: maps with one bar have one colour a count.
    """
    _draw_counts(ax, counts, most)
    for caustic in caustics:
        if caustic.kind != "point" and max(caustic.theta_extent, caustic.phi_extent) < _SMALL:
            _point_out(ax, caustic)
        draw_wrapped(ax, caustic, 1.1, 0.7, label=style.order_name(caustic.order))
    return celestial_sphere_axes(ax)


def _draw_counts(ax: Axes, counts: CountMap, most: int) -> None:
    """The counts as colours, and what they mean beside them."""
    total = counts.counts.sum(axis=2)
    seen = np.unique(np.append(total, np.arange(total.max(), most + 1)))
    name, low, high = _COLOURS
    colours = ListedColormap(colormaps[name](np.linspace(low, high, len(seen))))
    edges = np.arange(len(seen) + 1) - 0.5
    # Columns run from phi' = 0; the picture from -180.
    picture = np.searchsorted(seen, np.roll(total, total.shape[1] // 2, axis=1))
    norm = BoundaryNorm(edges, len(seen))
    image = ax.imshow(picture, extent=(-180, 180, 180, 0), cmap=colours, norm=norm, interpolation="nearest")
    bar = ax.figure.colorbar(image, ax=ax, ticks=np.arange(len(seen)), fraction=0.03, pad=0.02)
    bar.ax.set_yticklabels([str(count) for count in seen])
    bar.ax.tick_params(length=0)
    bar.ax.minorticks_off()
    # At infinity there is nothing of index 0.
    lowest = int(counts.counts.any(axis=(0, 1)).argmax())
    bar.set_label(f"images of index {lowest} to {counts.counts.shape[2] - 1}")


def _point_out(ax: Axes, caustic: Caustic) -> None:
    """The name of a caustic that is too small to be seen, and a line to it."""
    place = wrapped(np.degrees(caustic.celestial.mean(axis=0, keepdims=True)))[0]
    colour = style.order_colour(caustic.order)
    arrow = {"arrowstyle": "-", "color": colour, "linewidth": 0.8, "shrinkB": 1, "path_effects": [_HALO]}
    text = {"textcoords": "offset points", "ha": "center", "color": colour, "path_effects": [_HALO]}
    ax.annotate(style.order_name(caustic.order), tuple(place), (0, 30), arrowprops=arrow, **text)


def count_map_figure(counts: CountMap, caustics: CausticSet, most: int = 0) -> Figure:
    """Figure of the counts over their surface, 7 inches wide, with the camera in its title; most: as above."""
    if counts.surface.coordinates[0].unit != "rad":
        return plane_count_map_figure(counts, caustics)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 4.1), layout="constrained")
        ax = count_map_axes(figure.add_subplot(), counts, caustics, most)
        handles, labels = ax.get_legend_handles_labels()
        labels = [f"{label} caustic" for label in labels]
        figure.legend(handles, labels, loc="outside lower center", ncols=min(len(handles), 4))
        figure.suptitle(headline(caustics))
    return figure
