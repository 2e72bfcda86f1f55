"""
The trapped photon orbit
========================

A ray at the flat left edge of the shadow, for a = 0.999 and a camera at r = 2.6 on the equator, winds onto an orbit of
constant r before it escapes or falls in. Left: the ray's direction on the camera sky; middle: its orbit on the sphere
of that radius, the far side faint; right: θ against φ. Below: a ray of the mapping from the camera sky to the celestial
sphere, 0.0057 degrees outside that direction, followed backward from the camera. It comes in, winds close to the orbit,
and leaves: its last point in the picture is the place on the celestial sphere from which it comes. Of its 23.0 turns
18.1 are within 5 % of the radius of the orbit. Remakes JTFT figure 11.

The paper's: hole, camera, a direction at the flat edge, the orbit on its sphere: prograde and of a shallow pitch; that
rays of the mapping wind close to it, and leave. Ours: the ray that leaves, and the direction, 16° above the equator.
The radius follows from its angular momentum b, with the Carter constant q. The light circles the hole forward 18 times
while it swings up and down once between two latitudes, so rays a little outside the edge come from anywhere on the
celestial sphere between them, many times over, which is what makes the many images next to the flat edge. The model in
space, space_trapped_orbit, has the same orbit.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from scipy.integrate import solve_ivp

import kerrcaustics as kc
from kerrcaustics.beams.paths import RayPaths
from kerrcaustics.draw import style
from kerrcaustics.draw.palettes import STAR_COLOUR
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.projection import azimuthal_equidistant, view_axes
from kerrcaustics.draw.sky_axes import camera_sky_axes
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.frame import photon_of

CAMERA = kc.Camera(spin=0.999, radius=2.6)
# The direction: a point of the shadow edge, of EDGE_POINTS from the prograde end on the left over the top.
EDGE_POINTS, DIRECTION = 2000, 20
# How far outside it the ray of the mapping is, radians.
OUTSIDE = 1e-4
# How long the orbit is followed, in Mino time, and from which latitude it is looked at, degrees.
DURATION, LATITUDE = 3.05, 20.0


def main(output: Path) -> list[Path]:
    edge = kc.shadow_edge(CAMERA, EDGE_POINTS)
    seen = photon_of(CAMERA.frame(), tuple(edge[DIRECTION]))
    radius, _ = kerr.spherical_orbit_of_impact(CAMERA.spin, seen.b)
    theta, phi = orbit(float(radius), seen.b, seen.q)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 5.4), layout="constrained")
        grid = figure.add_gridspec(2, 6, height_ratios=[1.25, 1])
        sky, sphere, angles = (figure.add_subplot(grid[0, i : i + 2]) for i in (0, 2, 4))
        draw_ray(figure.add_subplot(grid[1, :3]), figure.add_subplot(grid[1, 3:]), winding_ray(edge), radius)
        draw_direction(sky, edge).set_title("direction on the camera sky")
        draw_sphere(sphere, theta, phi).set_title(f"orbit at r = {radius:.4f} M")
        angles.plot(np.degrees(phi), np.degrees(theta), color=style.PALETTE[1], linewidth=0.9)
        angles.set(xlabel="φ (deg)", ylabel="θ (deg)", ylim=(180, 0), title=f"b = {seen.b:.4f}, q = {seen.q:.4f}")
        angles.yaxis.set_major_locator(MultipleLocator(45))
        angles.xaxis.set_major_locator(MultipleLocator(style.tick_step(float(np.degrees(np.ptp(phi))), 5)))
        figure.suptitle(f"spin {CAMERA.spin}, camera at radius {CAMERA.radius}, circular orbit")
    return write_line_art(figure, output, "trapped_orbit")


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


def winding_ray(edge: np.ndarray) -> RayPaths:
    """The ray that is seen a little outside the shadow, beside the direction of the orbit."""
    along = edge[DIRECTION + 1] - edge[DIRECTION - 1]
    # The edge runs clockwise, on the sky that is seen from within.
    outward = np.cross(along, edge[DIRECTION])
    return kc.ray_paths(CAMERA, edge[DIRECTION] + OUTSIDE * outward / np.linalg.norm(outward), n=4000)


def draw_ray(far: Axes, angles: Axes, ray: RayPaths, radius: float) -> None:
    """Radius and polar angle of a ray against the turns about the axis, from the camera on."""
    turns = np.abs(ray.azimuth) / (2 * math.pi)
    line = {"color": style.PALETTE[0], "linewidth": 0.9}
    far.plot(turns, ray.radius, **line)
    far.axhline(radius, color=style.PALETTE[1], linewidth=0.9, label="orbit of constant r")
    far.plot(0, CAMERA.radius, "ks", markersize=4, label="camera")
    style.log_axis(far, 1, 100, ticks=4)
    far.set(ylabel="r (M)", title=f"a ray {math.degrees(OUTSIDE):.4f} deg outside the shadow: {turns[-1]:.1f} turns")
    far.legend(loc="upper center")
    angles.plot(turns, np.degrees(ray.theta), **line)
    place = f"to θ′ = {math.degrees(ray.theta[-1]):.1f} deg on the celestial sphere"
    angles.plot(turns[-1], math.degrees(ray.theta[-1]), "*", color=STAR_COLOUR, markersize=9, label=place)
    angles.set(ylabel="θ (deg)", ylim=(180, 0))
    angles.yaxis.set_major_locator(MultipleLocator(45))
    angles.legend(loc="upper center")
    for ax in (far, angles):
        ax.set_xlabel("turns about the spin axis, followed backward")


def draw_direction(ax: Axes, edge: np.ndarray) -> Axes:
    """Shadow and critical curves on the camera sky, and the direction of the ray."""
    caustics = kc.caustics(CAMERA, orders=3)
    axes = view_axes(CAMERA, edge)
    ax.fill(*azimuthal_equidistant(edge, axes).T, **style.SHADOW)
    for caustic in caustics:
        curve = azimuthal_equidistant(np.concatenate([caustic.sky, caustic.sky[:2]]), axes)
        ax.plot(*curve.T, **style.order_line(caustic.order), linewidth=0.8)
    ax.plot(*azimuthal_equidistant(edge[DIRECTION], axes), "o", color="black", markersize=4)
    return camera_sky_axes(ax, 60)


def draw_sphere(ax: Axes, theta: np.ndarray, phi: np.ndarray) -> Axes:
    """The orbit, and circles of latitude and longitude, on a sphere seen from far away; the far side faint."""
    whole = np.linspace(0, 2 * math.pi, 361)
    for latitude in np.radians(np.arange(30, 180, 30)):
        draw_on_sphere(ax, np.full_like(whole, latitude), whole, color=style.GUIDE_COLOUR, linewidth=0.5)
    for longitude in np.radians(np.arange(0, 180, 30)):
        draw_on_sphere(ax, whole, np.full_like(whole, longitude), color=style.GUIDE_COLOUR, linewidth=0.5)
    ax.plot(np.cos(whole), np.sin(whole), color="#8c8c8c", linewidth=0.6)
    draw_on_sphere(ax, theta, phi, color=style.PALETTE[1], linewidth=0.8)
    ax.annotate("", (0, 1.35), (0, math.cos(math.radians(LATITUDE))), arrowprops={"arrowstyle": "->", "linewidth": 0.9})
    ax.annotate("spin", (0.05, 1.18), fontsize=style.SMALLEST_TEXT)
    ax.set(aspect="equal", xlim=(-1.4, 1.4), ylim=(-1.4, 1.4))
    ax.set_axis_off()
    return ax


def draw_on_sphere(ax: Axes, theta: np.ndarray, phi: np.ndarray, **line) -> None:
    """A curve on the unit sphere in an orthographic view; what is on its far side at a quarter of the strength."""
    tilt = math.radians(LATITUDE)
    x, y, z = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
    toward = x * math.cos(tilt) + z * math.sin(tilt)
    up = z * math.cos(tilt) - x * math.sin(tilt)
    for near in (False, True):
        kept = (toward > 0) == near
        ax.plot(np.where(kept, y, np.nan), np.where(kept, up, np.nan), alpha=1.0 if near else 0.25, **line)


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
