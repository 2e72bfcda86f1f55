"""The questions: commands for eight cameras, and the analyses of the library over viewers and surfaces.

Each public name of the library stands here once.
"""

import io
import json
import math
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np

import kerrcaustics as kc
from tests.command_line import run

Ask = Callable[[], Any]
Place = tuple[float, float]

CAMERAS = {
    "circular": "--spin 0.5 --radius 10",
    "fast": "--spin 0.98 --radius 2.2",
    "inclined": "--spin 0.7 --radius 15 --inclination 50",
    "spinless": "--spin 0 --radius 6.5 --inclination 80",
    "extreme": "--spin 0.999 --radius 2.6",
    "static": "--spin 0.3 --radius 30 --inclination 120 --velocity static",
    "far": "--spin 0.9 --radius 1e6 --inclination 60",
    "infinity": "--spin 0.9 --radius inf --inclination 80",
}
COMMANDS = {
    "caustics": "caustics --points",
    "caustics.sphere": "caustics --points --orders 2 --source-radius 20",
    "images": "images --star 77 141",
    "images.sphere": "images --star 77 141 --source-radius 20",
    "images.plane": "images --star 6 45 --plane 1",
    "tracks": "tracks --star-theta 77",
    "tracks.sphere": "tracks --star-theta 77 --max-index 1 --source-radius 20",
    "tracks.plane": "tracks --orbit 7 --plane 1 --max-index 1",
    "counts.star": "counts --star 77 141",
    "counts.stars": "counts --stars stars.csv --max-index 1",
    "counts.plane": "counts --stars sources.csv --plane 1 --max-index 1",
    "counts.map": "counts --map --rows 12",
    "magnification": "magnification --star 77 141 --size 1 --points",
    "amplification": "amplification --star 77 141 --frequency 0.5:20:4",
    "counts.circle": "counts --circle 20 30 --line 40 --points --max-index 1",
    "light-curve": "light-curve --orbit 7 --times 20 --crossings 2 --points",
}
# What takes longer, for few cameras.
FEW = {
    "caustics.plane": ("caustics --points --orders 2 --plane 1", ("inclined", "far")),
    "counts.map.sphere": ("counts --map --rows 12 --source-radius 20", ("inclined", "infinity")),
    "counts.map.plane": ("counts --map --rows 3 --plane 2 --max-index 1", ("inclined",)),
}
OTHERS = {
    "render": "render scene.toml --output picture.png",
    "sweep": "sweep sweep.toml --output sweep.zarr --no-resume",
    "scale": "scale --mass 4.3e6 --distance 8178",
}
FILES = {
    "stars.csv": "77,141\n20,-30\n101.5,3\n",
    "sources.csv": "6,45\n9,190\n",
    "scene.toml": (
        "[hole]\nspin = 0.6\n[camera]\nradius = 40\ninclination_deg = 80\n[view]\nwidth = 32\nheight = 18\n"
        'field_of_view_deg = 40\n[sky]\nkind = "checkerboard"\n'
    ),
    "sweep.toml": 'spin = [0.5, 0.9]\nradius = 8\ncompute = ["geometry", "cusps", "areas"]\norders = 2\n',
}


class Seen(NamedTuple):
    """A surface, and a place on it."""

    end: Any
    place: Place


def camera(*numbers: Any) -> Any:
    return kc.Camera(*numbers)


def observer(*numbers: Any) -> Any:
    return kc.Observer(**dict(zip(("spin", "inclination", "radius"), numbers, strict=False)))


VIEWERS = {
    "near": lambda: camera(0.9, 10.0),
    "moving": lambda: camera(0.7, 8.0, 1.2, (0.3, 0.5, -0.4)),
    "orbiting": lambda: camera(0.95, 6.0, 1.1, (0.0, 0.0, 0.6)),
    "far": lambda: camera(0.9, 1e6, 1.0),
    "observer": lambda: observer(0.9, 1.0, 1e4),
    "infinity": lambda: observer(0.8, 1.4),
}
SPHERE_PLACE, PLANE_PLACE = (1.4, 2.5), (6.0, 0.7)
SURFACES = {
    "sky": lambda viewer: Seen(math.inf, SPHERE_PLACE),
    "beyond": lambda viewer: Seen(2.5 * viewer.radius, SPHERE_PLACE),
    "within": lambda viewer: Seen(5.0, SPHERE_PLACE),
    "plane1": lambda viewer: Seen(kc.EquatorialPlane(1), PLANE_PLACE),
    "plane2": lambda viewer: Seen(kc.EquatorialPlane(2), PLANE_PLACE),
}
SPHERES, PLANES = ("sky", "beyond", "within"), ("plane1", "plane2")

VIEW = kc.pictures.View(24, 16, math.radians(40))
save = kc.save


def sky_of(viewer: Any, count: int = 40) -> np.ndarray:
    """Directions, or on the screen of an observer places, near the shadow and away from it."""
    size, turn = np.geomspace(0.02, 1.0, count), 2.4 * np.arange(count)
    if isinstance(viewer, kc.Observer):
        return 50 * np.stack([size * np.cos(turn), size * np.sin(turn)], axis=-1)
    wide = min(1.5, 30 / viewer.radius) * size
    return np.stack([-np.cos(wide), np.sin(wide) * np.cos(turn), np.sin(wide) * np.sin(turn)], axis=-1)


def caustics(viewer: Any, seen: Seen, orders: int = 2) -> Any:
    return kc.caustics(viewer, orders, end=seen.end)


def star_images(viewer: Any, seen: Seen) -> Any:
    return kc.star_images(viewer, seen.place, 2, end=seen.end)


def image_counts(viewer: Any, seen: Seen) -> Any:
    return kc.image_counts(viewer, [seen.place, (1.1 * seen.place[0], 4.0)], 1, end=seen.end)


def count_map(viewer: Any, seen: Seen) -> Any:
    return kc.count_map(viewer, 1, 4, end=seen.end)


def star_tracks(viewer: Any, seen: Seen) -> Any:
    return kc.star_tracks(viewer, seen.place[0], 1, end=seen.end)


def pair_events(viewer: Any, seen: Seen) -> Any:
    return kc.pair_events(viewer, seen.place[0], 1, end=seen.end)


def trace_rays(viewer: Any, seen: Seen) -> Any:
    return kc.trace_rays(viewer, sky_of(viewer), end=seen.end, time=True, redshift=True)


def trace_beams(viewer: Any, seen: Seen, engine: str = "auto") -> Any:
    return kc.trace_beams(viewer, sky_of(viewer), engine, end=seen.end, time=True)


def magnification(viewer: Any) -> Any:
    return kc.magnification(viewer, (1.4, 2.9), 0.01, max_index=1)


def amplification(viewer: Any) -> Any:
    return kc.amplification(viewer, (1.4, 2.9), [0.5, 5.0], max_index=1)


def diffraction_pattern(viewer: Any) -> Any:
    return kc.diffraction_pattern(viewer, ((1.5, 1.6), (3.1, 3.2)), 5.0, max_index=1, pixels=8)


def circle_images(viewer: Any) -> Any:
    return kc.circle_images(viewer, (0.4, 0.5), 1)


def crossings_of_line(viewer: Any) -> Any:
    return kc.crossings_of_line(circle_images(viewer), 0.7)


def follow_star(viewer: Any) -> Any:
    later = camera(viewer.spin, 1.01 * viewer.radius, viewer.inclination, viewer.velocity)
    return kc.follow_star([viewer, later], SPHERE_PLACE, 1)


def image_derivatives(viewer: Any) -> Any:
    return kc.image_derivatives(viewer, star_images(viewer, Seen(math.inf, SPHERE_PLACE)))


def caustic_derivatives(viewer: Any) -> Any:
    return kc.caustic_derivatives(viewer, 2)


def caustic_tubes(viewer: Any) -> Any:
    return kc.caustic_tubes(viewer, 2, np.array([math.inf, 30.0, 8.0]))


def ray_paths(viewer: Any) -> Any:
    return kc.ray_paths(viewer, sky_of(viewer, 8), 40)


def trapped_orbit() -> Any:
    return kc.trapped_orbit(0.9, 1.5, 60)


def shadow_edge(viewer: Any) -> Any:
    return {"edge": kc.shadow_edge(viewer, 36).tolist()}


def light_curve(viewer: Any) -> Any:
    return kc.light_curve(viewer, 7.0, 12, crossings=3)


def line_profile(viewer: Any) -> Any:
    return kc.line_profile(viewer, 3.0, 12.0, bins=20)


def isoradials(viewer: Any) -> Any:
    return kc.isoradials(viewer, [6.0, 12.0], 3, 60)


def disk() -> Any:
    return kc.disks.Disk(4.5, 18.0, kc.disks.PageThorne(6500), opacity=0.8)


def render(viewer: Any) -> Any:
    shifts = {"beaming": True, "colour_shift": True}
    return kc.render(viewer, VIEW, kc.skies.Checkerboard(), disk=disk(), delay=True, time=20.0, **shifts)


def trace_view(viewer: Any) -> Any:
    return kc.pictures.trace_view(viewer, VIEW, disk=disk(), delay=True)


def render_volume(viewer: Any) -> Any:
    def density(radius: Any, theta: Any, azimuth: Any) -> Any:
        return 0.3 * np.exp(-8 * np.cos(theta) ** 2 - 0.1 * (radius - 8) ** 2)

    def temperature(radius: Any, theta: Any, azimuth: Any) -> Any:
        return 5000 * (1 + 0.2 * np.sin(2 * azimuth)) + 0 * radius

    return kc.pictures.render_volume(
        viewer, VIEW, kc.disks.Volume(density, temperature, 5.0, 12.0, scale=2.0, motion="fiducial")
    )


def functional(viewer: Any) -> Any:
    place = viewer.spin, viewer.radius, viewer.inclination, sky_of(viewer, 8), viewer.velocity
    found = {"direction": kc.functional.direction(*place), "time": kc.functional.travel_time(*place)}
    return {name: np.asarray(array).tolist() for name, array in found.items()}


GRID = (
    (trace_rays, VIEWERS, SURFACES),
    (trace_beams, VIEWERS, SURFACES),
    (star_images, VIEWERS, SPHERES),
    (star_images, ("moving", "observer", "infinity"), PLANES),
    (image_counts, ("near", "moving", "infinity"), SPHERES),
    (image_counts, ("near", "moving", "infinity"), ("plane1",)),
    (caustics, VIEWERS, SPHERES),
    (caustics, ("moving",), PLANES),
    (caustics, ("infinity",), ("plane1",)),
    (count_map, ("near", "orbiting", "infinity"), SPHERES),
    (star_tracks, ("near", "orbiting", "far", "observer", "infinity"), SPHERES),
    (star_tracks, ("near", "orbiting"), ("plane1",)),
    (star_tracks, ("infinity",), ("plane2",)),
    (star_tracks, ("moving",), ("sky", "plane1")),
    (pair_events, ("orbiting", "infinity"), (*SPHERES, "plane1")),
)
"""Analyses of sources on a surface, the viewers and the surfaces."""

ALONE = (
    (circle_images, ("moving", "infinity")),
    (magnification, ("moving", "infinity")),
    (amplification, ("moving", "observer", "infinity")),
    (diffraction_pattern, ("moving",)),
    (crossings_of_line, ("near", "orbiting")),
    (follow_star, ("near", "moving")),
    (image_derivatives, ("moving", "orbiting", "observer")),
    (caustic_derivatives, ("near", "moving")),
    (caustic_tubes, ("near", "orbiting")),
    (ray_paths, VIEWERS),
    (shadow_edge, VIEWERS),
    (light_curve, ("moving", "far", "observer")),
    (line_profile, ("moving", "far", "infinity")),
    (isoradials, ("moving", "far", "infinity")),
    (render, ("moving", "orbiting", "observer")),
    (trace_view, ("orbiting",)),
    (render_volume, ("orbiting",)),
    (functional, ("moving", "far")),
)
"""Other analyses, and the viewers."""


class Captured:
    """The output of a command, as pytest's `capsys` has it."""

    def __init__(self) -> None:
        self.out, self.err = io.StringIO(), io.StringIO()

    def readouterr(self) -> Any:
        return NamedTuple("Text", [("out", str), ("err", str)])(self.out.getvalue(), self.err.getvalue())


def command(line: str) -> dict[str, Any]:
    """The status of a command, what it complains of, and its JSON; of a sweep the store too."""
    captured = Captured()
    with redirect_stdout(captured.out), redirect_stderr(captured.err):
        status, out, err = run(captured, *line.split(), "--quiet", "--json", "-")
    answer = {"status": status, "complaint": err, "json": json.loads(out) if out else None}
    return answer | ({"store": stored()} if line.startswith("sweep") else {})


def stored() -> dict[str, Any]:
    """The arrays of the store that a sweep made here."""
    import xarray

    with xarray.open_zarr("sweep.zarr") as store:
        return {str(name): array.values.tolist() for name, array in store.variables.items()}


def entries() -> Iterator[tuple[str, Ask]]:
    """The name of each entry, and what asks for it."""
    for name, (line, cameras) in ({key: (line, CAMERAS) for key, line in COMMANDS.items()} | FEW).items():
        for place in cameras:
            yield f"cli.{name}.{place}", partial(command, f"{line} {CAMERAS[place]}")
    for name, line in OTHERS.items():
        yield f"cli.{name}", partial(command, line)
    for analysis, viewers, surfaces in GRID:
        for viewer, surface in product(viewers, surfaces):
            yield f"api.{analysis.__name__}.{viewer}.{surface}", partial(on_surface, analysis, viewer, surface)
    for engine in ("closed-form", "integrated"):
        ask = partial(trace_beams, engine=engine)
        yield f"api.trace_beams.orbiting.sky.{engine}", partial(on_surface, ask, "orbiting", "sky")
    for analysis, viewers in ALONE:
        for viewer in viewers:
            yield f"api.{analysis.__name__}.{viewer}", partial(of_viewer, analysis, viewer)
    yield "api.trapped_orbit", trapped_orbit


def on_surface(analysis: Callable[..., Any], viewer: str, surface: str) -> Any:
    seen_from = VIEWERS[viewer]()
    return analysis(seen_from, SURFACES[surface](seen_from))


def of_viewer(analysis: Callable[..., Any], viewer: str) -> Any:
    return analysis(VIEWERS[viewer]())
