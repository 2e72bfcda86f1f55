"""
Hot spots, one effect after the other
=====================================

The picture drawn by an older tracer: spots on circular orbits of r = 6 to 9 round a hole that does not spin, seen from
r = 12. Each of five planes has orbits of its own, at inclinations of 83 to 86 degrees and rolled by 15 degrees, give or
take two; every spot has a brightness of its own, and a streak that fades quadratically. First the bending of light
alone (a), with all images at one moment; then with the light's travel time (b), with the shift of colours (c), and with
the shift of brightness (d), which is all there is. Below, the differences that the second and the last step make to
the brightness on the screen: travel time moves spots along their orbits, from where the difference is blue to where it
is red; the shift of brightness makes the left side brighter and the right side darker. Then half of the spots circle
the other way, and one of the planes is seen by an observer who circles the hole.

The second picture shows why spots that recede linger. Of 36 spots, evenly spaced on one orbit, those on the right come
from ever farther away: light from there is ever later, so that a spot is seen there for longer, and more of them are
seen there at one moment. Dots on the orbit, seen from above, are where a spot is seen at equal intervals of the
camera's time.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import MultipleLocator

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_picture
from kerrcaustics.draw.scenes import show_picture
from kerrcaustics.scenes.traced_view import TracedView

RADIUS, INNER, OUTER = 12.0, 6.0, 9.0
# Of a circular orbit there, as one at rest measures it.
SPEED = 1 / math.sqrt(RADIUS - 2)
# Degrees: inclination and roll of each plane.
PLANES = ((83.0, 13.6), (84.0, 16.2), (84.6, 14.4), (85.3, 16.9), (86.0, 15.0))
SPOTS, SIZE, STREAK, TIME = 900, 0.04, 6.0, 40.0
WIDTH, HEIGHT, FIELD = 400, 225, 2 * math.atan(1.28)
# Spots of the second picture, the radius of their orbit, and the inclination of its plane.
EVEN, MIDDLE, INCLINED = 36, 7.5, math.radians(PLANES[2][0])
ALL = {"beaming": True, "colour_shift": True, "delay": True, "time": TIME}


def disk(seed: int, retrograde: float = 0.0) -> kc.disks.Disk:
    """Spots of one plane, which hide nothing: so the light of several planes is a sum."""
    rng = np.random.default_rng(seed)
    radius, azimuth = np.sqrt(rng.uniform(INNER**2, OUTER**2, SPOTS)), rng.uniform(0, 2 * math.pi, SPOTS)
    temperature, brightness = rng.uniform(4000, 10_000, SPOTS), rng.uniform(0.3, 1.7, SPOTS)
    spots = kc.disks.Spots(
        radius,
        azimuth,
        temperature,
        SIZE,
        STREAK,
        brightness=brightness,
        retrograde=rng.random(SPOTS) < retrograde,
        fade="quadratic",
    )
    return kc.disks.Disk(INNER - 0.2, OUTER + 0.2, spots, opacity=0.0)


def traced(inclination: float, roll: float, speed: float | None = None) -> TracedView:
    """A plane as the camera sees it: without spin, orbits in any plane are those of the equator."""
    velocity = "static" if speed is None else (0.0, 0.0, speed)
    camera = kc.Camera(0.0, RADIUS, math.radians(inclination), velocity)
    forward = kc.pictures.View.toward_hole(camera, WIDTH, HEIGHT, FIELD).forward
    up = 0.0, math.sin(math.radians(roll)), math.cos(math.radians(roll))
    view = kc.pictures.View(WIDTH, HEIGHT, FIELD, forward=forward, up=up)
    return kc.pictures.trace_view(camera, view, sky=False, disk=disk(0), delay=True)


def main(output: Path) -> list[Path]:
    planes = [traced(*plane) for plane in PLANES]
    with rc_context(style.RC):
        pictures = one_after_the_other(planes), lingering(planes[2])
    names = "hot_spots_without", "hot_spots_linger"
    return [write_picture(figure, output / f"{name}.png") for figure, name in zip(pictures, names, strict=True)]


def one_after_the_other(planes: list[TracedView]) -> Figure:
    """The light of all planes, with one effect more from picture to picture, and what two of the steps change."""

    def light(retrograde: float = 0.0, **changes: bool) -> np.ndarray:
        return sum(plane.show(disk=disk(i, retrograde), **{**ALL, **changes}).light for i, plane in enumerate(planes))

    moving = traced(*PLANES[-1], SPEED)
    a = light(beaming=False, colour_shift=False, delay=False)
    b = light(beaming=False, colour_shift=False)
    c, d = light(beaming=False), light()
    pictures = {
        "(a) bent light, all at one moment": toned(a),
        "(b) and its travel time": toned(b),
        "(c) and the shift of colours": toned(c),
        "(d) and the shift of brightness": toned(d),
        "(b) less (a)": brightness(b) - brightness(a),
        "(d) less (c)": brightness(d) - brightness(c),
        "(d) with half of the spots circling the other way": toned(light(retrograde=0.5)),
        f"one plane of (d), camera at {SPEED:.3f} c": toned(moving.show(disk=disk(9), **ALL).light),
    }
    figure = Figure(figsize=(style.PAGE_WIDTH, 8.2), layout="constrained")
    panels = figure.subplots(4, 2, sharex=True, sharey=True).flat
    for ax, (name, picture) in zip(panels, pictures.items(), strict=True):
        show_picture(ax, moving.view, picture)
        ax.set_title(name)
        ax.label_outer()
        if picture.ndim == 2:
            ax.get_images()[0].set(cmap="RdBu_r", clim=(-1, 1))
            figure.colorbar(ax.get_images()[0], ax=ax, ticks=[-1, 0, 1], fraction=0.025, pad=0.02)
    figure.suptitle(f"hot spots round a hole without spin, seen from r = {RADIUS:g} M")
    return figure


def toned(light: np.ndarray) -> np.ndarray:
    return kc.pictures.tone_mapped(light, exposure=0.5, curve="asinh", softening=8)


def brightness(light: np.ndarray) -> np.ndarray:
    """On the screen, 0 to 1."""
    return toned(light).mean(axis=2) / 255


def lingering(plane: TracedView) -> Figure:
    """Equal spots on one orbit, with and without travel time, and where one of them is seen at equal intervals."""
    azimuth = 2 * math.pi * np.arange(EVEN) / EVEN
    spots = kc.disks.Spots(np.full(EVEN, MIDDLE), azimuth, 6500.0, 0.16, 0.0)
    ring = kc.disks.Disk(INNER - 0.2, OUTER + 0.2, spots, opacity=0.0)
    figure = Figure(figsize=(style.PAGE_WIDTH, 5.2), layout="constrained")
    (before, after), (above, course) = figure.subplots(2, 2)
    for ax, name, delay in ((before, "spots at one moment", False), (after, "spots as their light arrives", True)):
        light = plane.show(disk=ring, beaming=False, colour_shift=False, delay=delay).light
        show_picture(ax, plane.view, kc.pictures.tone_mapped(light, exposure=3.0))
        ax.set_title(name)
    draw_course(above, course, plane.camera)
    figure.suptitle(f"{EVEN} spots on an orbit of r = {MIDDLE:g} M, inclination {math.degrees(INCLINED):.1f} deg")
    return figure


def draw_course(above: Axes, course: Axes, camera: kc.Camera) -> None:
    """An orbit from above, with dots at equal intervals of the camera's time, and its azimuth against that time."""
    (seen,) = kc.isoradials(camera, [MIDDLE], crossings=1, points=720)
    rate, order = MIDDLE**-1.5, np.argsort(seen.azimuth % (2 * math.pi))
    phi, way = (seen.azimuth % (2 * math.pi))[order], seen.time[order]
    # When the light comes of a spot that is at phi.
    arrival = phi / rate + way - way.min()
    period = 2 * math.pi / rate
    times = arrival[0] + period * np.arange(EVEN) / EVEN
    places = np.interp(times, np.append(arrival, arrival[0] + period), np.append(phi, phi[0] + 2 * math.pi))
    turn = np.linspace(0, 2 * math.pi, 361)
    # The camera is below, its right on the right.
    above.plot(np.sin(turn) * MIDDLE, -np.cos(turn) * MIDDLE, color=style.GUIDE_COLOUR)
    above.add_patch(Circle((0, 0), 2, facecolor="black"))
    above.plot(np.sin(places) * MIDDLE, -np.cos(places) * MIDDLE, "o", color=style.PALETTE[1], markersize=4)
    head = {"arrowstyle": "-|>", "color": "black", "linewidth": 0.9}
    above.annotate("to the camera", (0, -12), (0, -9.5), ha="center", va="bottom", arrowprops=head)
    for side, words in (
        (-1, "comes nearer:\neach later light\nhas a shorter way"),
        (1, "recedes:\neach later light\nhas a longer way"),
    ):
        above.annotate("", (side * 6.2, side * 2), (side * 6.2, -side * 2), arrowprops=head)
        above.annotate(words, (side * 8.4, 0), ha="left" if side > 0 else "right", va="center")
    above.set(xlim=(-15.5, 15.5), ylim=(-12.5, 8), aspect="equal", title=f"seen from above, {EVEN} times an orbit")
    above.set_axis_off()
    whole = np.append(arrival, arrival[0] + period), np.degrees(np.append(phi, phi[0] + 2 * math.pi))
    start = float(np.interp(90, whole[1], whole[0]))
    course.plot(whole[0] - start, whole[1], color=style.PALETTE[1], label="as its light arrives")
    course.plot(whole[0] - start, 90 + np.degrees(rate * (whole[0] - start)), **style.CRITICAL, label="at one moment")
    course.axhspan(0, 180, color="#f3e3d6", zorder=0)
    course.annotate("recedes", (0.04, 150), xycoords=("axes fraction", "data"))
    course.annotate("comes nearer", (0.04, 200), xycoords=("axes fraction", "data"))
    course.set(
        xlabel="time of the camera (M)", ylabel="φ of a spot (deg)", title="a spot is seen for longer on its way out"
    )
    course.yaxis.set_major_locator(MultipleLocator(90))
    course.legend(loc="lower right")


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
