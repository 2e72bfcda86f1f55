"""Picture of the image counts over the equatorial plane, with the caustics in it."""

import math

import numpy as np
from jaxtyping import Float
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MultipleLocator, NullLocator

from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.stars.counts import CountMap

Array = np.ndarray

# As on the celestial sphere.
_COLOURS = ("YlGnBu", 0.0, 0.66)
_TURNS = np.arange(-3, 4) * 360


def plane_count_map_axes(ax: Axes, counts: CountMap, caustics: CausticSet) -> Axes:
    """Total image counts by azimuth (degrees, -180 to 180) and radius (logarithmic), and the caustics in the plane.

    caustics: of the same camera and crossing. A colour bar is put beside the axes.
    """
    _draw_counts(ax, counts)
    low_r, high_r = ax.get_ylim()
    for curve in caustics:
        if curve.r_min > high_r or curve.r_max < low_r:
            continue
        place = np.append(curve.place, curve.place[:1], axis=0) if curve.closed else curve.place
        for turn in _TURNS:
            line = style.order_line(curve.order)
            ax.plot(np.degrees(place[:, 1]) + turn, place[:, 0], linewidth=1.1, **line)
    ax.set_yscale("log")
    ax.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_minor_locator(NullLocator())
    ax.set(xlim=(-180, 180), ylim=(low_r, high_r), xlabel="φ (deg)", ylabel="r (M)")
    ax.xaxis.set_major_locator(MultipleLocator(60))
    return ax


def _draw_counts(ax: Axes, counts: CountMap) -> None:
    """The counts as colours, and what they mean beside them."""
    total = counts.counts.sum(axis=2)
    seen = np.unique(total)
    name, low, high = _COLOURS
    colours = ListedColormap(colormaps[name](np.linspace(low, high, len(seen))))
    norm = BoundaryNorm(np.arange(len(seen) + 1) - 0.5, len(seen))
    columns = total.shape[1]
    picture = np.searchsorted(seen, np.roll(total, columns // 2, axis=1))
    phi = np.linspace(-180, 180, columns + 1)
    image = ax.pcolormesh(phi, np.exp(_edges(np.log(counts.level))), picture, cmap=colours, norm=norm)
    bar = ax.figure.colorbar(image, ax=ax, ticks=np.arange(len(seen)), fraction=0.03, pad=0.02)
    bar.ax.set_yticklabels([str(count) for count in seen])
    bar.ax.tick_params(length=0)
    bar.ax.minorticks_off()
    bar.set_label(f"images of index 0 to {counts.max_index}")


def plane_count_map_figure(counts: CountMap, caustics: CausticSet) -> Figure:
    """Figure of `plane_count_map_axes`, 7 inches wide, with the camera in its title."""
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 4.1), layout="constrained")
        ax = plane_count_map_axes(figure.add_subplot(), counts, caustics)
        orders = sorted({curve.order for curve in caustics})
        names = {order: ax.plot([], [], **style.order_line(order))[0] for order in orders}
        labels = [f"{style.order_name(order)} caustic" for order in orders]
        if orders:
            figure.legend(list(names.values()), labels, loc="outside lower center", ncols=4)
        camera = caustics.camera
        where = (
            f"spin {camera.spin:g}, $r_c$ = {camera.radius:g}, inclination {math.degrees(camera.inclination):.4g} deg"
        )
        figure.suptitle(f"{where}; {counts.surface.in_words()}")
    return figure


def _edges(centres: Float[Array, " n"]) -> Float[Array, " n+1"]:
    """Edges of cells about their centres."""
    if len(centres) == 1:
        return np.array([centres[0] - 0.1, centres[0] + 0.1])
    inner = (centres[1:] + centres[:-1]) / 2
    return np.concatenate([[2 * centres[0] - inner[0]], inner, [2 * centres[-1] - inner[-1]]])
