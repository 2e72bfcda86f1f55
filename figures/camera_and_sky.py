"""
From the camera's sky to the celestial sphere
=============================================

What is mapped to what. At the camera's place a fiducial observer (FIDO) has the basis e_r, e_θ, e_φ (grey, drawn
below it). The camera moves past it with the velocity β (red), which sets the camera's own axes: e_y along it, e_x in
the plane of e_r and e_φ, e_z perpendicular to both. A direction (θcs, φcs) on the camera's local sky is followed
backward along a ray to a place (θ′, φ′) on the celestial sphere. A beam that is a circle on the camera's sky becomes an
ellipse there, with the diameters δ₊ and δ₋, whose major axis is at the angle μ from e_θ′, the direction of increasing
θ′. Remakes JTFT figure 1.

The paper's: what is drawn, and its names. Ours: which ray is shown. It is a real one, for a hole without spin and a
camera at r = 6.03 that moves along e_φ, so slowly that aberration does not show; the shape and the angle of the ellipse
are real, too. Sizes are not to scale, and the celestial sphere is drawn at r = 12 instead of infinity.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from scipy.integrate import solve_ivp

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.spacetime.frame import photon_of

CAMERA = kc.Camera(spin=0.0, radius=6.03, velocity=(0.0, 0.0, 1e-3))
# The direction that is followed, degrees; radii of the two spheres; half the width of the beam at the camera.
THETA_CS, PHI_CS = 55.0, 243.0
LOCAL, CELESTIAL, BEAM = 2.6, 12.0, 0.17
# Where the scene is seen from, degrees.
AZIMUTH, LATITUDE = -62.0, 22.0
COLOURS = {"camera": style.PALETTE[0], "sky": style.PALETTE[2], "ray": style.PALETTE[1], "fido": "#777777"}
VELOCITY = "#c00000"
# From the tips of arrows to the middle of their names, points of type.
BEYOND = 9.0
X, Y, Z = np.eye(3)
HALO = withStroke(linewidth=3, foreground="white")


def main(output: Path) -> list[Path]:
    theta, phi = math.radians(THETA_CS), math.radians(PHI_CS)
    line_of_sight = np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])
    beam = kc.trace_beams(CAMERA, line_of_sight, end=CELESTIAL)
    with rc_context(style.RC):
        figure = Figure(figsize=(5.0, 5.2), layout="constrained")
        ax = figure.add_subplot(aspect="equal")
        ax.set_axis_off()
        draw_celestial_sphere(ax, beam)
        draw_hole(ax)
        draw_camera_sky(ax, line_of_sight, theta, phi)
        draw(ax, ray(line_of_sight), color=COLOURS["ray"], linewidth=1.6, zorder=4)
        ax.margins(0.02)
    return write_line_art(figure, output, "camera_and_sky")


def ray(line_of_sight: np.ndarray) -> np.ndarray:
    """The ray as points (n, 3): in its plane u'' = 3 u^2 - u, with u = 1/r against the angle swept."""
    seen = photon_of(CAMERA.frame(), tuple(line_of_sight))
    across = line_of_sight - line_of_sight[0] * X
    across /= np.linalg.norm(across)

    def arrives(_angle: float, state: np.ndarray) -> float:
        return state[0] - 1 / CELESTIAL

    arrives.terminal = True
    start = [1 / CAMERA.radius, seen.rate[0] / math.sqrt(seen.k)]
    path = solve_ivp(lambda _, y: [y[1], 3 * y[0] ** 2 - y[0]], (0, 10), start, events=arrives, max_step=0.02)
    return (np.outer(np.cos(path.t), X) + np.outer(np.sin(path.t), across)) / path.y[0][:, None]


def draw_camera_sky(ax: Axes, line_of_sight: np.ndarray, theta: float, phi: float) -> None:
    """The camera's local sky with its axes, the angles of the direction, and the beam's circle."""
    centre, colour = CAMERA.radius * X, COLOURS["camera"]
    draw_globe(ax, centre, LOCAL, colour)
    for axis, name in ((X, "$e_x$"), (Y, "$e_y$"), (Z, "$e_z$")):
        draw_arrow(ax, centre, centre + 1.5 * LOCAL * axis, name, colour="black")
    draw_observer(ax, centre)
    sides = np.linspace(0, phi, 60)[:, None]
    draw(ax, centre + LOCAL * (np.cos(sides) * X + np.sin(sides) * Y), color=colour, linewidth=1.4)
    level = np.array([math.cos(phi), math.sin(phi), 0])
    draw(ax, np.stack([centre, centre + LOCAL * level]), color=colour, linewidth=0.8, linestyle="--")
    down = np.linspace(0, theta, 60)[:, None]
    draw(ax, centre + LOCAL * (np.cos(down) * Z + np.sin(down) * level), color=colour, linewidth=1.4)
    draw(ax, np.stack([centre, centre + LOCAL * line_of_sight]), color=COLOURS["ray"], linewidth=1.0, linestyle="--")
    write(ax, centre + 1.12 * LOCAL * (math.cos(phi / 2) * X + math.sin(phi / 2) * Y), r"$\varphi_\mathrm{cs}$", colour)
    write(
        ax,
        centre + 1.13 * LOCAL * (math.cos(theta / 2) * Z + math.sin(theta / 2) * level),
        r"$\theta_\mathrm{cs}$",
        colour,
    )
    first = np.cross(Z, line_of_sight) / np.linalg.norm(np.cross(Z, line_of_sight))
    turn = np.linspace(0, 2 * math.pi, 60)[:, None]
    circle = np.cos(turn) * first + np.sin(turn) * np.cross(line_of_sight, first)
    draw(ax, centre + LOCAL * (line_of_sight + BEAM * circle), color=COLOURS["ray"], linewidth=1.2, zorder=5)
    write(ax, centre + 2.15 * LOCAL * Z, "camera's local sky", colour)


def draw_observer(ax: Axes, centre: np.ndarray) -> None:
    """The basis of the fiducial observer at the camera's place, drawn below it, and the camera's velocity past it."""
    beside, length = centre - 1.9 * LOCAL * Z, 1.15 * LOCAL
    for axis, name in ((X, "$e_r$"), (Y, r"$e_\varphi$"), (-Z, r"$e_\theta$")):
        draw_arrow(ax, beside, beside + length * axis, name, colour=COLOURS["fido"])
    above = beside + 0.32 * length * Z - 0.12 * length * X
    draw_arrow(ax, above, above + 0.75 * length * Y, "β", colour=VELOCITY)
    write(ax, beside - 1.6 * length * Z, "FIDO's basis, at the same place", COLOURS["fido"])


def draw_celestial_sphere(ax: Axes, beam: kc.Beams) -> None:
    """The celestial sphere with the angles of the ray's end and the beam's ellipse."""
    colour, end = COLOURS["sky"], beam.direction
    draw_globe(ax, np.zeros(3), CELESTIAL, colour)
    theta, phi = math.acos(end[2]), math.atan2(end[1], end[0])
    level = np.array([math.cos(phi), math.sin(phi), 0])
    sides, down = np.linspace(0, phi, 90)[:, None], np.linspace(0, theta, 90)[:, None]
    draw(ax, CELESTIAL * (np.cos(sides) * X + np.sin(sides) * Y), color=colour, linewidth=1.4)
    draw(ax, CELESTIAL * (np.cos(down) * Z + np.sin(down) * level), color=colour, linewidth=1.4)
    write(ax, 1.12 * CELESTIAL * (math.cos(phi / 2) * X + math.sin(phi / 2) * Y), "φ′", colour)
    write(ax, 1.08 * CELESTIAL * (math.cos(theta / 2) * Z + math.sin(theta / 2) * level), "θ′", colour)
    e_theta = math.cos(theta) * level - math.sin(theta) * Z
    e_phi = np.cross(end, e_theta)
    mu = float(beam.position_angle)
    turn = np.linspace(0, 2 * math.pi, 60)[:, None]
    major, minor = math.cos(mu) * e_theta + math.sin(mu) * e_phi, math.cos(mu) * e_phi - math.sin(mu) * e_theta
    ellipse = float(beam.delta_plus) * np.cos(turn) * major + float(beam.delta_minus) * np.sin(turn) * minor
    draw(ax, CELESTIAL * (end + 0.6 * BEAM * ellipse), color=COLOURS["ray"], linewidth=1.2, zorder=5)
    draw_axes(ax, end, {"major": float(beam.delta_plus) * major, "minor": float(beam.delta_minus) * minor}, e_theta)
    write(ax, -1.12 * CELESTIAL * Z, "celestial sphere", colour)


def draw_axes(ax: Axes, end: np.ndarray, halves: dict[str, np.ndarray], e_theta: np.ndarray) -> None:
    """The diameters of the ellipse, and the angle from e_theta' to the major one."""
    scale = 0.6 * BEAM * CELESTIAL
    centre, colour = CELESTIAL * end, COLOURS["ray"]
    for (name, half), away in zip(halves.items(), (-1.45, -1.9), strict=True):
        draw(ax, np.stack([centre - scale * half, centre + scale * half]), color=colour, linewidth=0.8)
        write(ax, centre + away * scale * half, r"$\delta_+$" if name == "major" else r"$\delta_-$", colour)
    length = 1.25 * np.linalg.norm(scale * halves["major"])
    draw_arrow(ax, centre, centre + length * e_theta, r"$e_{\theta'}$", colour="black")
    major = halves["major"] / np.linalg.norm(halves["major"])
    along = np.linspace(0, 1, 30)[:, None]
    arc = (1 - along) * e_theta + along * major
    arc /= np.linalg.norm(arc, axis=1, keepdims=True)
    draw(ax, centre + 0.55 * length * arc, color="black", linewidth=0.8)
    write(ax, centre + 0.75 * length * arc[15], "μ", "black")


def draw_hole(ax: Axes) -> None:
    """The hole and its axis."""
    right, up = projected(np.zeros(3))
    ax.fill(right + 2 * np.cos(np.linspace(0, 7, 200)), up + 2 * np.sin(np.linspace(0, 7, 200)), "black", zorder=3)
    draw_arrow(ax, 2 * Z, 4.5 * Z, "spin axis", colour="black")


def draw_globe(ax: Axes, centre: np.ndarray, radius: float, colour: str) -> None:
    """Outline, equator and two circles of longitude of a sphere."""
    turn = np.linspace(0, 2 * math.pi, 200)[:, None]
    right, up = projected(centre)
    ax.plot(right + radius * np.cos(turn), up + radius * np.sin(turn), color=colour, linewidth=0.7, alpha=0.7)
    for first, second in ((X, Y), (X, Z), (Y, Z)):
        draw(
            ax, centre + radius * (np.cos(turn) * first + np.sin(turn) * second), color=colour, linewidth=0.5, alpha=0.4
        )


def draw_arrow(ax: Axes, start: np.ndarray, end: np.ndarray, name: str, colour: str) -> None:
    arrow = {"arrowstyle": "->", "linewidth": 0.9, "color": colour, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", projected(end), projected(start), arrowprops=arrow)
    along = np.array(projected(end - start))
    write(ax, end, name, colour, BEYOND * along / np.linalg.norm(along))


def write(ax: Axes, place: np.ndarray, text: str, colour: str, beside: np.ndarray | None = None) -> None:
    """Words with their middle at a place; beside: so many points of type to the right and up of it."""
    look = {"ha": "center", "va": "center", "color": colour, "fontsize": 9, "path_effects": [HALO], "zorder": 6}
    offset = (0.0, 0.0) if beside is None else tuple(beside)
    ax.annotate(text, projected(place), offset, textcoords="offset points", **look)


def draw(ax: Axes, points: np.ndarray, **line) -> None:
    ax.plot(*projected(points), **line)


def projected(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Right and up on the page, of points (..., 3), seen from far away."""
    azimuth, latitude = math.radians(AZIMUTH), math.radians(LATITUDE)
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0])
    toward = np.array(
        [math.cos(latitude) * math.cos(azimuth), math.cos(latitude) * math.sin(azimuth), math.sin(latitude)]
    )
    return points @ right, points @ np.cross(toward, right)


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
