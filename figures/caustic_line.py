"""
The caustic line without spin
=============================

Rays in the plane through a hole without spin, the camera at r = 6.03 (square) and a star, drawn in the Schwarzschild
coordinates r, φ; what the camera sees of them; and both in space. The primary caustic is the line behind the hole, from
the horizon outward: at each point of it the rays of a whole cone meet, and a star there is seen as the Einstein ring. A
star beside it is seen twice: its primary ray passes the hole on one side and is seen outside the ring; its secondary
ray passes on the other side and is seen inside. In the plane sources are infinitely far away, and the dashed rays that
meet on the line are parallel; in space the celestial sphere is drawn at r = 12, where the sources are. Remakes JTFT
figure 3.

The paper's: the caustic line, the cone of rays to it, the ring on the camera's local sky, a star with its primary and
its secondary ray, and the celestial sphere, all in space. Ours: the camera's radius and the place of the star; in the
plane, also the secondary caustic, the line behind the camera, whose rays turn through 360 degrees. The cones have the
impact parameters 6.4936 and 5.2540, the shadow 5.1962. In space the local sky is drawn as a small sphere round the
camera, which is at rest; in these coordinates the sphere is flattened along r, so that rays leave it where it shows
their images.

Writes pictures (PNG, PDF), a model (glTF) and a page on which the model can be rotated with the mouse (HTML).
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from scipy.integrate import solve_ivp

import kerrcaustics as kc
from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.palettes import STAR_COLOUR
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.projection import azimuthal_equidistant, view_axes, whole_line
from kerrcaustics.draw.sky_axes import camera_sky_axes, critical_line
from kerrcaustics.draw.solids import CAMERA_COLOUR, HORIZON_COLOUR, Model, SpaceCurve, Surface
from kerrcaustics.draw.space import write_model
from kerrcaustics.draw.titles import headline
from kerrcaustics.spacetime.frame import photon_of
from kerrcaustics.spacetime.sphere import from_angles

CAMERA = kc.Camera(spin=0.0, radius=6.03, velocity="fiducial")
# The star of the rays, degrees from the camera round the hole; where rays leave the picture; rays of the cone.
STAR, FAR, CONE = 150.0, 13.5, 24
# In space: radius of the sources, radius of the local sky, and angle between the plane of the star's rays and the
# horizontal, radians.
SOURCES, LOCAL, TURN = 12.0, 1.4, 0.5
VIOLET, PALE, SKY_COLOUR, GRID_COLOUR = "#8a2be2", "#b9a3d6", "#a9cbe8", "#d8d8d8"
LABELS = (
    ("camera", (6.5, -1.6)),
    ("primary caustic", (-10.6, 0.6)),
    ("secondary\ncaustic", (8.0, 0.6)),
    ("to the star", (-5.6, 12.3)),
    ("to the star", (-12.9, 1.9)),
    ("to a point straight behind", (-13.0, 7.0)),
    ("horizon", (-1.8, -3.0)),
)


def main(output: Path) -> list[Path]:
    caustics = kc.caustics(CAMERA, orders=2)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 4.3), layout="constrained")
        plane, sky = figure.subplots(1, 2)
        draw_rays(plane, caustics).set_title("rays of a star (solid) and of the rings (dashed)")
        draw_local_sky(sky, caustics).set_title("the camera's local sky")
        figure.suptitle(headline(caustics))
    return [*write_line_art(figure, output, "caustic_line"), *write_model(in_space(), output, "space_caustic_line")]


def draw_rays(ax: Axes, caustics: CausticSet) -> Axes:
    """The two images of a star, the rays of the Einstein rings, and the caustics that they come from."""
    ax.add_patch(Circle((0, 0), 2, facecolor=HORIZON_COLOUR))
    for caustic, far in zip(caustics, (-FAR, FAR), strict=True):
        colour = style.order_colour(caustic.order)
        ax.plot([math.copysign(2, far), far], [0, 0], color=colour, linewidth=4, alpha=0.25)
        for side in (-1, 1):
            ax.plot(*ray(caustic.sky[0], side), color=colour, linewidth=0.8, linestyle=(0, (4, 2)))
    images = star_seen()
    names = "primary ray", "secondary ray"
    for line_of_sight, azimuth, index in zip(images.sky, images.azimuth, images.index, strict=True):
        path, colour = ray(line_of_sight, math.copysign(1, azimuth)), style.index_colour(index)
        ax.plot(*path, color=colour, linewidth=1.8, label=names[index])
    ax.plot(CAMERA.radius, 0, "ks", markersize=4)
    for text, place in LABELS:
        ax.annotate(text, place, fontsize=style.SMALLEST_TEXT)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=2)
    ax.set(xlim=(-FAR, FAR), ylim=(-FAR, FAR), aspect="equal", xlabel="r cos φ (M)", ylabel="r sin φ (M)")
    return ax


def draw_local_sky(ax: Axes, caustics: CausticSet) -> Axes:
    """The shadow, the rings and the two images of the star, as the camera sees them."""
    edge = kc.shadow_edge(CAMERA, 400)
    axes = view_axes(CAMERA, edge)
    ax.fill(*azimuthal_equidistant(edge, axes).T, **style.SHADOW)
    names = "Einstein ring (primary)", "secondary ring"
    for caustic, name in zip(caustics, names, strict=True):
        line = {**style.order_line(caustic.order), "linestyle": (0, (4, 2))}
        ax.plot(*critical_line(caustic, axes).T, label=name, **line)
    images = star_seen()
    for index, name in enumerate(("primary image", "secondary image")):
        place = azimuthal_equidistant(images.sky[images.index == index], axes)
        ax.plot(*place.T, "o", color=style.index_colour(index), markeredgecolor="black", label=name)
    ax.set(xlim=(-90, 90), ylim=(-90, 90), aspect="equal")
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=2)
    return camera_sky_axes(ax, 30)


def star_seen(end: float = math.inf) -> kc.StarImages:
    """The primary and the secondary image of the star, on a sphere of sources."""
    return kc.star_images(CAMERA, (math.pi / 2, math.radians(STAR)), max_index=1, end=end)


def in_space() -> Model:
    """Horizon, caustic line, the cone of rays to a place on it, the two rays to a star beside it, and both skies."""
    ring = kc.caustics(CAMERA, orders=1, end=SOURCES)[0].sky
    cone = in_plane(*ray(ring[0], 1, SOURCES))
    lines = [SpaceCurve("caustic line", np.array([[-2.0, 0, 0], [-SOURCES, 0, 0]]), VIOLET, 7.0)]
    lines += [SpaceCurve("ray of the cone", turned(cone, 2 * math.pi * k / CONE), PALE, 1.5) for k in range(CONE)]
    lines += [SpaceCurve("celestial sphere", SOURCES * line, GRID_COLOUR, 1.0) for line in grid()]
    lines.append(SpaceCurve("Einstein ring", local(whole_line(ring, True)), VIOLET, 5.0))
    marks = [(np.array([CAMERA.radius, 0, 0]), CAMERA_COLOUR, 0.2), (cone[-1], VIOLET, 0.3)]
    images = star_seen(SOURCES)
    for line_of_sight, azimuth, index in zip(images.sky, images.azimuth, images.index, strict=True):
        # Turned out of the plane, so that it is seen from above.
        path = turned(in_plane(*ray(line_of_sight, math.copysign(1, azimuth), SOURCES)), TURN)
        lines.append(SpaceCurve("ray of the star", path, style.index_colour(index), 5.0))
        marks.append((turned(local(line_of_sight), TURN), style.index_colour(index), 0.2))
    marks.append((path[-1], STAR_COLOUR, 0.3))
    lines += [SpaceCurve("mark", place + bar, colour, 6.0) for place, colour, size in marks for bar in crosses(size)]
    key = (("primary caustic, a line", VIOLET), ("rays that meet at a place on it", PALE),
           ("primary ray to a star", style.index_colour(0)), ("secondary ray", style.index_colour(1)),
           ("the star", STAR_COLOUR), ("camera", CAMERA_COLOUR), ("its local sky with the Einstein ring", "#5f8fb8"),
           (f"celestial sphere, drawn at r = {SOURCES:g} M", "#9a9a9a"), ("horizon", HORIZON_COLOUR))  # fmt: skip
    title = f"Caustic line, spin 0, camera at r = {CAMERA.radius:g} M"
    around = sphere()
    surfaces = Surface("horizon", 2 * around, HORIZON_COLOUR), Surface("local sky", local(around), SKY_COLOUR, 0.3)
    return Model(title, surfaces, tuple(lines), key, (-72.0, 20.0), extent=11.8)


def sphere() -> np.ndarray:
    """Points (48, 96, 3) of the unit sphere."""
    return from_angles(*np.meshgrid(np.linspace(0, math.pi, 48), np.linspace(0, 2 * math.pi, 96), indexing="ij"))


def grid() -> list[np.ndarray]:
    """Meridians and parallels of the unit sphere, every 30 degrees."""
    half, whole = np.linspace(0, math.pi, 91), np.linspace(0, 2 * math.pi, 181)
    meridians = [from_angles(half, np.full_like(half, phi)) for phi in np.radians(np.arange(0, 360, 30))]
    return meridians + [from_angles(np.full_like(whole, theta), whole) for theta in np.radians(np.arange(30, 180, 30))]


def local(sky: np.ndarray) -> np.ndarray:
    """Places (..., 3) of directions on the local sky: lengths along r are shorter by sqrt(1 - 2/r) in coordinates."""
    shape = np.array([math.sqrt(1 - 2 / CAMERA.radius), 1.0, 1.0])
    return np.array([CAMERA.radius, 0.0, 0.0]) + LOCAL * shape * np.asarray(sky)


def in_plane(right: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Points (n, 3) of a path in the plane of x and y."""
    return np.stack([right, up, np.zeros_like(up)], axis=-1)


def crosses(size: float) -> np.ndarray:
    """Three bars (3, 2, 3) along the axes."""
    return size * np.stack([np.outer([-1, 1], axis) for axis in np.eye(3)])


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    """Points (n, 3) turned about the x axis."""
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]])


def ray(line_of_sight: np.ndarray, side: float, until: float = 1.5 * FAR) -> tuple[np.ndarray, np.ndarray]:
    """A ray in its plane, from the camera to a radius: u'' = 3 u^2 - u with u = 1/r against the angle swept."""
    seen = photon_of(CAMERA.frame(), tuple(line_of_sight))
    start = [1 / CAMERA.radius, seen.rate[0] / math.sqrt(seen.k)]

    def leaves(_angle: float, state: np.ndarray) -> float:
        return state[0] - 1 / until

    leaves.terminal = True
    path = solve_ivp(lambda _, y: [y[1], 3 * y[0] ** 2 - y[0]], (0, 10), start, events=leaves, rtol=1e-9, max_step=0.03)
    return np.cos(path.t) / path.y[0], side * np.sin(path.t) / path.y[0]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
