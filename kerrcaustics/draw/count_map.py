"""Picture of the image counts over a surface of sources, with the caustics on it."""

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MultipleLocator, NullLocator

from kerrcaustics.curves.caustic import Caustic, CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.projection import whole_line
from kerrcaustics.draw.sky_axes import celestial_sphere_axes, draw_wrapped, is_sphere, point_out, wrapped
from kerrcaustics.draw.titles import headline
from kerrcaustics.images.counts import CountMap
from kerrcaustics.shapes import Float

Array = np.ndarray

# Light enough for the lines of caustics on top, which are cool.
_COLOURS = ("YlOrBr", 0.0, 0.62)
# Whole turns by which a curve in the plane is drawn again.
_TURNS = np.arange(-3, 4) * 360


def count_map_axes(ax: Axes, counts: CountMap, caustics: CausticSet | tuple[Caustic, ...] = (), most: int = 0) -> Axes:
    """Total image counts over a surface, one colour a count, and the caustics; radii on a logarithmic scale.

    Parameters
    ----------
    ax : Axes
        Where to draw; a colour bar is put beside it.
    counts : CountMap
        What `count_map` returned.
    caustics : CausticSet, optional
        Of the same camera and surface; drawn wrapped into phi' of -180 to 180 degrees. theta' is 0 at the top.
    most : int
        Highest count of the colour bar, where the map's own is lower: maps with one bar have one colour a count.
    """
    _draw_counts(ax, counts, most)
    if not is_sphere(counts.surface):
        return _draw_curves(ax, caustics)
    for caustic in caustics:
        point_out(ax, caustic, wrapped(np.degrees(caustic.celestial.mean(axis=0, keepdims=True)))[0])
        draw_wrapped(ax, caustic, 1.1, 0.7, label=style.order_name(caustic.order))
    return celestial_sphere_axes(ax)


def _draw_curves(ax: Axes, caustics: CausticSet | tuple[Caustic, ...]) -> Axes:
    """Draw caustics in the plane, as far as the map reaches, and name the axes."""
    low, high = ax.get_ylim()
    named: set[int] = set()
    for curve in caustics:
        if curve.r_min > high or curve.r_max < low:
            continue
        label = {} if curve.order in named else {"label": style.order_name(curve.order)}
        named.add(curve.order)
        radius, phi = whole_line(curve.place, curve.closed).T
        lines = np.degrees(phi)[:, None] + _TURNS, np.tile(radius[:, None], len(_TURNS))
        drawn = ax.plot(*lines, linewidth=1.1, **style.order_line(curve.order))
        drawn[0].set(**label)
    ax.set_yscale("log")
    ax.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_minor_locator(NullLocator())
    ax.set(xlim=(-180, 180), ylim=(low, high), xlabel="φ (deg)", ylabel="r (M)")
    ax.xaxis.set_major_locator(MultipleLocator(60))
    return ax


def _draw_counts(ax: Axes, counts: CountMap, most: int) -> None:
    """The counts as colours, and their legend beside them."""
    total = counts.counts.sum(axis=2)
    levels = np.unique(np.append(total, np.arange(total.max(), most + 1)))
    name, low, high = _COLOURS
    colours = ListedColormap(colormaps[name](np.linspace(low, high, len(levels))))
    norm = BoundaryNorm(np.arange(len(levels) + 1) - 0.5, len(levels))
    # Columns run from phi' = 0; the picture from -180.
    columns = total.shape[1]
    picture = np.searchsorted(levels, np.roll(total, columns // 2, axis=1))
    if is_sphere(counts.surface):
        image = ax.imshow(picture, extent=(-180, 180, 180, 0), cmap=colours, norm=norm, interpolation="nearest")
    else:
        radii = np.exp(_edges(np.log(counts.level)))
        image = ax.pcolormesh(np.linspace(-180, 180, columns + 1), radii, picture, cmap=colours, norm=norm)
    bar = ax.figure.colorbar(image, ax=ax, ticks=np.arange(len(levels)), fraction=0.03, pad=0.02)
    bar.ax.set_yticklabels([str(count) for count in levels])
    bar.ax.tick_params(length=0)
    bar.ax.minorticks_off()
    # At infinity there is nothing of index 0.
    lowest = int(counts.counts.any(axis=(0, 1)).argmax())
    bar.set_label(f"images of index {lowest} to {counts.max_index}")


def _edges(centres: Float[Array, " n"]) -> Float[Array, " n+1"]:
    """Edges of cells about their centres."""
    if len(centres) == 1:
        return np.array([centres[0] - 0.1, centres[0] + 0.1])
    inner = (centres[1:] + centres[:-1]) / 2
    return np.concatenate([[2 * centres[0] - inner[0]], inner, [2 * centres[-1] - inner[-1]]])


def count_map_figure(counts: CountMap, caustics: CausticSet, most: int = 0) -> Figure:
    """Figure of the counts over their surface, 7 inches wide, with the camera in its title; most: as above."""
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 4.1), layout="constrained")
        ax = count_map_axes(figure.add_subplot(), counts, caustics, most)
        handles, labels = ax.get_legend_handles_labels()
        if labels:
            labels = [f"{label} caustic" for label in labels]
            figure.legend(handles, labels, loc="outside lower center", ncols=min(len(handles), 4))
        where = "" if is_sphere(counts.surface) else f"\n{counts.surface.in_words()}"
        figure.suptitle(headline(caustics) + where)
    return figure
