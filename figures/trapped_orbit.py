"""
The trapped photon orbit
========================

A ray at the flat left edge of the shadow, for a = 0.999 and a camera at r = 2.6 on the equator, winds onto an orbit of
constant r before it escapes or falls in. Large: that orbit on its sphere, the far side faint. The light circles the
hole forward 18 times while it swings up and down once between two latitudes. Beside it: the ray's direction on the
camera sky. Below: a ray of the mapping from the camera sky to the celestial sphere, 0.0057 degrees outside that
direction, followed backward from the camera. It comes in, winds close to the orbit, and leaves: its last point in the
picture is the place on the celestial sphere from which it comes. Of its 23.0 turns 18.1 are within 5 % of the radius of
the orbit. Remakes JTFT figure 11.

The paper's: hole, camera, a direction at the flat edge, the orbit on its sphere: prograde and of a shallow pitch; that
rays of the mapping wind close to it, and leave. Ours: the ray that leaves, and the direction, 16° above the equator.
The radius follows from its angular momentum b, with the Carter constant q. Rays a little outside the edge come from
anywhere on the celestial sphere between the two latitudes, many times over, which is what makes the many images next to
the flat edge. The model in space, space_trapped_orbit, has the same orbit.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

import kerrcaustics as kc
from kerrcaustics.beams.paths import RayPaths
from kerrcaustics.draw import style
from kerrcaustics.draw.palettes import STAR_COLOUR
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.projection import azimuthal_equidistant, view_axes
from kerrcaustics.draw.sky_axes import camera_sky_axes, critical_line
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.frame import photon_of, sky_from_fido
from kerrcaustics.spacetime.shadow import edge_photons

CAMERA = kc.Camera(spin=0.999, radius=2.6)
# The direction: a phase of the shadow edge, from 0 at its prograde end on the left over the top; points of the edge.
DIRECTION, EDGE_POINTS = 0.02 * math.pi, 2000
# How far outside it the ray of the mapping is, radians.
OUTSIDE = 1e-4
# How long the orbit is followed, in Mino time, and from which latitude it is looked at, degrees.
DURATION, LATITUDE = 3.05, 20.0
FAR = 100.0
ORBIT, RAY = style.PALETTE[1], style.PALETTE[0]
TEXT: dict[str, Any] = {"textcoords": "offset points", "va": "center"}


def main(output: Path) -> list[Path]:
    direction = at_edge(DIRECTION)
    seen = photon_of(CAMERA.frame(), tuple(direction))
    radius, _ = kerr.spherical_orbit_of_impact(CAMERA.spin, seen.b)
    theta, phi = orbit(float(radius), seen.b, seen.q)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 6.3), layout="constrained")
        grid = figure.add_gridspec(2, 2, height_ratios=[2.1, 1], width_ratios=[2.1, 1])
        below = grid[1, :].subgridspec(1, 2)
        draw_ray(*(figure.add_subplot(place) for place in below), winding_ray(direction), radius, theta)
        draw_direction(figure.add_subplot(grid[0, 1]), direction).set_title("direction on the camera sky")
        title = f"orbit at r = {radius:.4f} M: b = {seen.b:.4f}, q = {seen.q:.4f}"
        draw_sphere(figure.add_subplot(grid[0, 0]), theta, phi).set_title(title)
        figure.suptitle(f"spin {CAMERA.spin}, camera at radius {CAMERA.radius}, circular orbit")
    return write_line_art(figure, output, "trapped_orbit")


def at_edge(phase: float) -> np.ndarray:
    """The direction (3,) of a phase of the shadow edge."""
    return np.asarray(sky_from_fido(CAMERA.frame(), edge_photons(CAMERA, np.array([phase]))))[0]


def orbit(radius: float, b: float, q: float) -> tuple[np.ndarray, np.ndarray]:
    """theta and phi of a photon at constant radius, from the equator upward.

    In Mino time; theta'' = -(d/dtheta) (cos^2 theta (b^2 / sin^2 theta - a^2)) / 2, phi' from Kerr's first integral.
    """
    a = CAMERA.spin
    delta = radius**2 - 2 * radius + a**2

    def rates(_time: float, state: np.ndarray) -> list[float]:
        theta, speed, _ = state
        s, c = math.sin(theta), math.cos(theta)
        return [speed, c * (b**2 / s**3 - a**2 * s), b / s**2 - a + a * (radius**2 + a**2 - a * b) / delta]

    path = solve_ivp(rates, (0, DURATION), [math.pi / 2, -math.sqrt(q), 0], rtol=1e-9, atol=1e-9, max_step=0.001)
    return path.y[0], path.y[2]


def winding_ray(direction: np.ndarray) -> RayPaths:
    """The ray that is seen a little outside the shadow, beside the direction of the orbit."""
    along = at_edge(1.05 * DIRECTION) - at_edge(0.95 * DIRECTION)
    # The edge runs clockwise, on the sky that is seen from within.
    outward = np.cross(along, direction)
    return kc.ray_paths(CAMERA, direction + OUTSIDE * outward / np.linalg.norm(outward), n=4000)


def draw_ray(far: Axes, angles: Axes, ray: RayPaths, radius: float, theta: np.ndarray) -> None:
    """Radius and polar angle of a ray against the turns about the axis, from the camera on."""
    turns = np.abs(ray.azimuth) / (2 * math.pi)
    far.plot(turns, ray.radius, color=RAY)
    far.axhline(radius, color=ORBIT, linewidth=0.9, zorder=1)
    far.annotate("orbit of constant r", (1, radius), (0, -9), color=ORBIT, **TEXT)
    far.plot(0, CAMERA.radius, "ks", markersize=4)
    far.annotate("camera", (0, CAMERA.radius), (6, 2), **TEXT)
    far.annotate("the ray", (3, ray.radius[turns > 3][0]), (0, 8), color=RAY, **TEXT)
    style.log_axis(far, 0.55, FAR, ticks=4)
    far.set(ylabel="r (M)", title=f"a ray {math.degrees(OUTSIDE):.4f} deg outside the shadow: {turns[-1]:.1f} turns")
    angles.plot(turns, np.degrees(ray.theta), color=RAY)
    least = math.degrees(theta.min())
    for level in (least, 180 - least):
        angles.axhline(level, color=ORBIT, linewidth=0.9, zorder=1)
    angles.annotate("turning latitudes of the orbit", (1.5, 180 - least), (0, -9), color=ORBIT, **TEXT)
    last = turns[-1], math.degrees(ray.theta[-1])
    angles.plot(*last, "*", color=STAR_COLOUR, markersize=9)
    place = f"comes from θ′ = {last[1]:.1f} deg\non the celestial sphere"
    line = {"arrowstyle": "-", "color": STAR_COLOUR, "linewidth": 0.8, "shrinkB": 4}
    angles.annotate(place, last, (21, least - 26), color=STAR_COLOUR, ha="right", va="top", arrowprops=line)
    angles.set(ylabel="θ (deg)", ylim=(180 - least + 12, least - 28), title="the same ray: polar angle")
    angles.yaxis.set_major_locator(MultipleLocator(15))
    for ax in (far, angles):
        ax.set_xlabel("turns about the spin axis, followed backward")


def draw_direction(ax: Axes, direction: np.ndarray) -> Axes:
    """Shadow and critical curves on the camera sky, and the direction of the ray."""
    caustics, edge = kc.caustics(CAMERA, orders=3), kc.shadow_edge(CAMERA, EDGE_POINTS)
    axes = view_axes(CAMERA, edge)
    ax.fill(*azimuthal_equidistant(edge, axes).T, **style.SHADOW)
    ax.annotate("shadow", (0, 0), ha="center", color="#606060")
    for caustic in caustics:
        ax.plot(*critical_line(caustic, axes).T, **style.order_line(caustic.order), linewidth=0.9)
    for order, place, turned in ((1, (-23, 95), 0), (2, (-70, 0), 90), (3, (-22, -28), 0)):
        text = {"ha": "center", "va": "center", "rotation": turned, "color": style.order_colour(order)}
        ax.annotate(style.order_name(order), place, **text)
    place = azimuthal_equidistant(direction, axes)
    ax.plot(*place, "o", color=ORBIT, markersize=5)
    arrow = {"arrowstyle": "-", "color": ORBIT, "linewidth": 0.8, "shrinkB": 3}
    ax.annotate("the ray", place, (22, 14), color=ORBIT, textcoords="offset points", arrowprops=arrow)
    ax.set(ylim=(-105, 105))
    return camera_sky_axes(ax, 60)


def draw_sphere(ax: Axes, theta: np.ndarray, phi: np.ndarray) -> Axes:
    """The orbit, and circles of latitude and longitude, on a sphere seen from far away; the far side faint."""
    whole, least = np.linspace(0, 2 * math.pi, 361), float(theta.min())
    ax.fill(np.cos(whole), np.sin(whole), facecolor="#f2f5f8", edgecolor="#8c8c8c", linewidth=0.8)
    for latitude in np.radians([30, 60, 120, 150]):
        draw_on_sphere(ax, np.full_like(whole, latitude), whole, color=style.GUIDE_COLOUR, linewidth=0.5)
    for longitude in np.radians(np.arange(0, 180, 30)):
        draw_on_sphere(ax, whole, np.full_like(whole, longitude), color=style.GUIDE_COLOUR, linewidth=0.5)
    draw_on_sphere(ax, theta, phi, color=ORBIT, linewidth=1.1)
    for level in (least, math.pi / 2, math.pi - least):
        draw_on_sphere(ax, np.full_like(whole, level), whole, color="black", linewidth=0.7, linestyle=(0, (4, 3)))
    tilt = math.radians(LATITUDE)
    arrow = {"arrowstyle": "-|>", "color": "black", "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", (0, 1.22), (0, math.cos(tilt)), arrowprops=arrow)
    ax.annotate("spin axis", (0, 1.16), (6, 0), **TEXT)
    name_levels(ax, [least, math.pi / 2, math.pi - least])
    middle = int(np.argmin(np.abs(phi - 2 * math.pi * 13)))
    place = on_picture(theta[middle], phi[middle])[:2]
    line = {"arrowstyle": "-", "color": ORBIT, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("photon orbit", place, (0, -0.88), ha="center", color=ORBIT, arrowprops=line)
    # The way of the light, on the near side.
    front = (np.abs(phi - 2 * math.pi * 8 - 0.35).argmin(), np.abs(phi - 2 * math.pi * 8 - 0.4).argmin())
    tail, head = (on_picture(theta[i], phi[i])[:2] for i in front)
    ax.annotate("", head, tail, arrowprops={**arrow, "color": ORBIT, "linewidth": 0, "mutation_scale": 16})
    ax.set(aspect="equal", xlim=(-1.05, 1.75), ylim=(-1.05, 1.25))
    ax.set_axis_off()
    return ax


def name_levels(ax: Axes, levels: list[float]) -> None:
    """Names of the least polar angle, of the equator and of the largest one, beside the sphere."""
    line = {"arrowstyle": "-", "color": "#606060", "linewidth": 0.6, "shrinkA": 2, "shrinkB": 0}
    for level, name, height in zip(
        levels, ("turns back at", "equator,", "turns back at"), (0.55, 0.0, -0.55), strict=True
    ):
        place = on_picture(level, 0.5 * math.pi)[:2]
        ax.annotate(f"{name}\nθ = {math.degrees(level):.1f} deg", place, (1.15, height), va="center", arrowprops=line)


def on_picture(theta: ArrayLike, phi: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Right, up and toward the reader of places on the unit sphere, in an orthographic view."""
    tilt = math.radians(LATITUDE)
    x, y, z = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
    return y, z * math.cos(tilt) - x * math.sin(tilt), x * math.cos(tilt) + z * math.sin(tilt)


def draw_on_sphere(ax: Axes, theta: np.ndarray, phi: np.ndarray, **line: Any) -> None:
    """A curve on the unit sphere; what is on its far side at a quarter of the strength."""
    right, up, toward = on_picture(theta, phi)
    for near in (False, True):
        kept = (toward > 0) == near
        ax.plot(np.where(kept, right, np.nan), np.where(kept, up, np.nan), alpha=1.0 if near else 0.25, **line)


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
