"""Check that no image of a near source is missing, with a slow twin that does not use caustics.

    kerrcaustics study near_sources

Random cameras, each with a sphere of finite radius or a crossing of the equatorial plane, and sources at random
azimuths on one circle of it. The twin (`twin.py`) traces a dense grid of the sky with the integrator, and starts
Newton's method wherever a cell leads around the source. Wrong is a certified answer that lacks an image of the twin, or
has one that by the integrator does not lead to the source with the index it claims. The twin misses images too, where
cells of its grid are large: these are counted, not held against anybody. Spheres among photon orbits are refused, and
drawn anew. The picture shows the pairs by the radii of camera and source, those that share both as a ring of dots.
Writes near_sources.json, near_sources.png and near_sources.md.
"""

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

import kerrcaustics as kc
from kerrcaustics.beams.ends import EquatorialPlane, Sphere
from kerrcaustics.draw import style
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table
from kerrcaustics.spacetime import kerr

from .twin import Twin

QUESTION = "Are all images of near sources found?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 40
QUICK_SECONDS = 5

# Groups of pairs that share camera and circle, of each kind, and pairs in a group.
SPHERES, PLANES, AZIMUTHS = 3, 3, 8
# Highest Morse index, for spheres and in the plane; highest crossing.
HIGHEST, HIGHEST_IN_PLANE, CROSSINGS = 2, 3, 3
# Images closer than this on the camera sky are the same; ends of ours may miss the source by so much, relative to r.
_SAME, _MISSED = 1e-5, 1e-6

# What became of a pair: marker, colour of the palette, size. Size of a group's ring, in e-folds of both radii.
LOOKS = {"agree": ("o", 0, 1.5), "twin missed": ("^", 4, 2.2), "not certified": ("s", 3, 2.5), "wrong": ("X", 1, 5)}
RING = (0.055, 0.14)


@dataclass(frozen=True)
class Pair:
    """Findings for one camera and one source.

    end: "sphere" or "crossing n"; radius, polar_angle (degrees, None in the plane), azimuth: of the source; images: how
    many; lacking: images of the twin that are not among them; false: images that lead elsewhere; missed: images that
    the twin lacks.
    """

    end: str
    spin: float
    camera_radius: float
    inclination: float
    radius: float
    polar_angle: float | None
    azimuth: float
    images: int
    certified: bool
    lacking: int
    false: int
    missed: int
    remarks: tuple[str, ...]

    @property
    def wrong(self) -> bool:
        """True if a certified answer is not true."""
        return self.certified and self.lacking + self.false > 0

    @property
    def verdict(self) -> str:
        """In a word or two."""
        if self.wrong:
            return "wrong"
        return "not certified" if not self.certified else "twin missed" if self.missed else "agree"


Search = Callable[[float], tuple[kc.StarImages, np.ndarray, np.ndarray]]


def random_camera(chance: np.random.Generator) -> kc.Camera:
    """Any spin, some none at all; 2.5 to 100 from the hole; anywhere but in the plane of the equator."""
    spin = float(chance.uniform(0, 0.998)) if chance.uniform() < 0.9 else 0.0
    inclination = math.acos(float(chance.uniform(-0.995, 0.995)))
    return kc.Camera(spin, 2.5 * 40 ** float(chance.uniform()), inclination, "fiducial")


def random_radius(camera: kc.Camera, chance: np.random.Generator) -> float:
    """Between a twentieth and twenty camera radii, outside the horizon."""
    low, high = max(1.02 * kerr.horizon(camera.spin), camera.radius / 20), 20 * camera.radius
    return low * (high / low) ** float(chance.uniform())


def on_sphere(chance: np.random.Generator, azimuths: int) -> Iterator[Pair | None]:
    """Sources on one circle of a sphere; None where that is refused."""
    camera = random_camera(chance)
    radius, theta = random_radius(camera, chance), math.acos(float(chance.uniform(-0.995, 0.995)))
    turns = chance.uniform(0, 2 * math.pi, azimuths).tolist()
    twin = None
    for phi in turns:
        try:
            images = kc.star_images(camera, (theta, phi), HIGHEST, end=radius)
        except ValueError:
            yield None
            return
        twin = twin or Twin(camera, Sphere(radius))
        yield compared(camera, (radius, theta, phi), images, twin.images((theta, phi), HIGHEST), Sphere(radius))


def in_plane(chance: np.random.Generator, azimuths: int) -> Iterator[Pair | None]:
    """Sources on one circle of the plane, at one crossing."""
    camera = random_camera(chance)
    end = EquatorialPlane(int(chance.integers(1, CROSSINGS + 1)))
    radius, twin = random_radius(camera, chance), Twin(camera, end)
    for phi in chance.uniform(0, 2 * math.pi, azimuths).tolist():
        images = kc.star_images(camera, (radius, phi), HIGHEST_IN_PLANE, end=end)
        yield compared(camera, (radius, None, phi), images, twin.images((radius, phi), HIGHEST_IN_PLANE), end)


def compared(
    camera: kc.Camera,
    source: tuple[float, float | None, float],
    images: kc.StarImages,
    twins: np.ndarray,
    end: Sphere | EquatorialPlane,
) -> Pair:
    """An answer against the twin's."""
    gaps = np.linalg.norm(images.sky[:, None] - twins[None, :, :3], axis=-1)
    same = (gaps < _SAME) & (images.index[:, None] == twins[None, :, 3])
    radius, theta, phi = source
    return Pair(
        end="sphere" if isinstance(end, Sphere) else f"crossing {end.crossing}",
        spin=camera.spin,
        camera_radius=camera.radius,
        inclination=math.degrees(camera.inclination),
        radius=radius,
        polar_angle=None if theta is None else math.degrees(theta),
        azimuth=math.degrees(phi),
        images=len(images),
        certified=images.certified,
        lacking=int((~same.any(axis=0)).sum()),
        false=int((~lead_there(camera, source, images, end)).sum()),
        missed=int((~same.any(axis=1)).sum()),
        remarks=images.remarks,
    )


def lead_there(
    camera: kc.Camera, source: tuple[float, float | None, float], images: kc.StarImages, end: Sphere | EquatorialPlane
) -> np.ndarray:
    """True for images (n,) that the integrator too follows to the source, with the same index."""
    true = np.zeros(len(images), bool)
    radius, theta, phi = source
    goal = radius * (
        np.array([math.cos(phi), math.sin(phi), 0.0])
        if theta is None
        else np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])
    )
    for second, surface in enumerate(end.arrivals()):
        these = np.flatnonzero(images.second_arrival == second)
        if len(these) == 0:
            continue
        beams = kc.trace_beams(camera, images.sky[these], "integrated", 1e-11, end=surface)
        away = np.linalg.norm(beams.direction * np.asarray(beams.radius)[:, None] - goal, axis=1)
        true[these] = (away < _MISSED * radius) & (np.asarray(beams.index) == images.index[these])
    return true


def groups(
    kind: Callable[[np.random.Generator, int], Iterator[Pair | None]], seed: int, count: int, azimuths: int, stop: float
) -> tuple[list[Pair], int]:
    """Pairs of `count` groups, fewer where the clock says `stop` before; how many groups were refused."""
    chance = np.random.default_rng(seed)
    pairs: list[Pair] = []
    done = refused = 0
    while done < count and time.perf_counter() < stop:
        found = list(kind(chance, azimuths))
        if None in found:
            refused += 1
            continue
        done += 1
        pairs += [pair for pair in found if pair is not None]
    return pairs, refused


def picture(pairs: list[Pair]) -> Figure:
    """The figure of the study: all pairs, by the radii of camera and source; a group is a ring about its own."""
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.7), layout="constrained")
        axes = figure.subplots(1, 2, sharey=True)
        for ax, name in zip(axes, ("sphere", "crossing"), strict=True):
            draw_pairs(ax, [pair for pair in pairs if pair.end.startswith(name)])
            ax.set_title("sources on spheres" if name == "sphere" else "sources in the plane")
        axes[0].set_ylabel("source's radius $r$")
    return figure


def draw_pairs(ax: Axes, pairs: list[Pair]) -> None:
    """Pairs of one kind of end, each a dot, with what became of it."""
    place = ringed(pairs)
    for verdict, (marker, colour, size) in LOOKS.items():
        these = [i for i, pair in enumerate(pairs) if pair.verdict == verdict]
        dots = {"color": style.PALETTE[colour], "markersize": size, "markeredgewidth": 0, "linestyle": "none"}
        ax.plot(*place[these].T, marker=marker, label=f"{verdict}: {len(these)}", **dots)
    ax.set(xscale="log", yscale="log", xlabel="camera's radius $r_c$", xlim=(2, 120), ylim=(1, 3e4))
    ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_locator(NullLocator())
    ax.axline((10, 10), (20, 20), color=style.GUIDE_COLOUR, linewidth=0.8, zorder=0)
    ax.legend(loc="upper left", markerscale=1.4)


def ringed(pairs: list[Pair]) -> np.ndarray:
    """Places (n, 2) of pairs on the picture: radii of camera and source, the pairs of a group round the same place."""
    groups = Counter((pair.camera_radius, pair.radius) for pair in pairs)
    seen: Counter[tuple[float, float]] = Counter()
    places = []
    for pair in pairs:
        group = pair.camera_radius, pair.radius
        turn = 2 * math.pi * seen[group] / groups[group]
        seen[group] += 1
        ring = np.array([math.cos(turn), math.sin(turn)]) * (groups[group] > 1)
        places.append(group * np.exp(ring * RING))
    return np.array(places).reshape(-1, 2)


def table(pairs: list[Pair]) -> str:
    """Counts of verdicts by kind of end."""
    heads = ["sources", "pairs", "certified", "wrong", "not certified, and lacking images", "twin missed"]
    lines = []
    for name, chosen in by_kind(pairs).items():
        numbers = (
            len(chosen),
            sum(pair.certified for pair in chosen),
            sum(pair.wrong for pair in chosen),
            sum(not pair.certified and pair.lacking > 0 for pair in chosen),
            sum(pair.missed > 0 for pair in chosen),
        )
        lines.append([name, *map(str, numbers)])
    return markdown_table(heads, lines)


def by_kind(pairs: list[Pair]) -> dict[str, list[Pair]]:
    """Pairs beyond the camera's radius, within it, and in the plane, by crossing."""
    kinds: dict[str, list[Pair]] = {}
    for pair in pairs:
        side = "beyond the camera's radius" if pair.radius > pair.camera_radius else "within the camera's radius"
        name = f"sphere {side}" if pair.end == "sphere" else f"plane, {pair.end}"
        kinds.setdefault(name, []).append(pair)
    return dict(sorted(kinds.items(), key=lambda kind: kind[0], reverse=True))


def findings(pairs: list[Pair]) -> list[str]:
    """Findings, a sentence for each kind of end."""
    found = []
    for name, chosen in (
        ("on spheres", [pair for pair in pairs if pair.end == "sphere"]),
        ("in the plane", [pair for pair in pairs if pair.end != "sphere"]),
    ):
        certified = sum(pair.certified for pair in chosen)
        found.append(
            f"Of {len(chosen)} random pairs of camera and source {name} {certified} are certified, and "
            f"{sum(pair.wrong for pair in chosen)} of these answers are wrong; the twin missed images of "
            f"{sum(pair.missed > 0 for pair in chosen)}."
        )
    return found


QUICK: dict[str, Any] = {"spheres": 2, "planes": 2, "azimuths": 4}
"""Arguments of `main` for a quick run."""


def main(
    output: Path,
    spheres: int = SPHERES,
    planes: int = PLANES,
    azimuths: int = AZIMUTHS,
    seed: int = 1979,
    longest: float = math.inf,
) -> list[Path]:
    """Run the study; the files in `output`.

    spheres, planes: groups of so many azimuths; longest: seconds after which no group is begun, half of them for each.
    """
    began = time.perf_counter()
    on_spheres, refused = groups(on_sphere, seed, spheres, azimuths, began + longest / 2)
    now = time.perf_counter()
    pairs = on_spheres + groups(in_plane, seed + 1, planes, azimuths, now + longest / 2)[0]
    text = table(pairs)
    print(text)
    return write_study(
        output,
        "near_sources",
        __doc__ or "",
        picture(pairs),
        text,
        settings={"groups on spheres": spheres, "groups in the plane": planes, "azimuths": azimuths, "seed": seed},
        findings=findings(pairs),
        verdicts=Counter(pair.verdict for pair in pairs),
        refused=refused,
        exceptions=[asdict(pair) for pair in pairs if pair.verdict != "agree"],
        pairs=[asdict(pair) for pair in pairs],
        seconds=time.perf_counter() - began,
    )
