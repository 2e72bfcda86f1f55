"""Check magnifications of sources of finite size against sums over rays, and measure what they cost.

    kerrcaustics study extended_sources

Random viewers, near and far, with sources on the celestial sphere, on spheres outside and within the viewer's radius,
and in the equatorial plane; radii from 1e-7 to 3 rad. Half of the sources lie at caustics: across them, inside, about
them, or tangent to them. The twin (`twin.py`) is an adaptive sum over rays, which knows nothing of curves and images;
its own error is taken from its two finest levels of cells. Wrong is a certified magnification that differs from the
sum by more than both errors. The picture shows the reported errors, with the differences, by run time.
Writes extended_sources.json, extended_sources.png and extended_sources.md.
"""

import math
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.beams.ends import End, EquatorialPlane, Sphere, end_of
from kerrcaustics.draw import style
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.viewer import Viewer

from .twin import summed

QUESTION = "Do magnifications of discs agree with sums?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 300
QUICK_SECONDS = 12

# Discs of each kind, highest Morse index, and crossings of the plane.
DISCS, HIGHEST, CROSSINGS = 6, 2, 3
# Errors of the twin that a difference may amount to, and a relative one below which nothing is held against it.
_TWIN_ERRORS, _TWIN_LEAST = 4.0, 5e-4

# Marker and colour of the palette.
LOOKS = {"agree": ("o", 0), "not certified": ("s", 3), "wrong": ("X", 1)}


@dataclass(frozen=True)
class Disc:
    """A source, and its magnifications.

    kind: its surface; spin, viewer_radius, inclination (degrees); place: as `kc.magnification` takes it; size: its
    radius; at_caustic: the order of the caustic beside it, 0 where it was drawn without looking; total, error: of the
    magnification; twin, twin_error: of the sum over rays; seconds: of the magnification.
    """

    kind: str
    spin: float
    viewer_radius: float
    inclination: float
    end: str
    place: tuple[float, float]
    size: float
    max_index: int
    at_caustic: int
    total: float
    error: float
    certified: bool
    twin: float
    twin_error: float
    seconds: float
    remarks: tuple[str, ...]

    @property
    def off(self) -> float:
        """Difference from the twin."""
        return abs(self.total - self.twin)

    @property
    def beyond(self) -> bool:
        """True if the difference is more than both errors."""
        return self.off > self.error + _TWIN_ERRORS * self.twin_error + _TWIN_LEAST * self.twin

    @property
    def verdict(self) -> str:
        """In a word or two."""
        if not self.certified:
            return "not certified"
        return "wrong" if self.beyond else "agree"


def random_camera(chance: np.random.Generator) -> kc.Camera:
    """Any spin, some none at all; 2.5 to 1,000 from the hole; at rest in its place or moving."""
    spin = float(chance.uniform(0, 0.999)) if chance.uniform() < 0.9 else 0.0
    inclination = math.acos(float(chance.uniform(-0.99, 0.99)))
    velocity = "fiducial" if chance.uniform() < 0.7 else tuple((0.5 * chance.uniform(-1, 1, 3)).tolist())
    return kc.Camera(spin, 2.5 * 400 ** float(chance.uniform()), inclination, velocity)


def random_viewer(chance: np.random.Generator) -> Viewer:
    """A camera; one in ten is an observer at infinity."""
    camera = random_camera(chance)
    if chance.uniform() < 0.9:
        return camera
    return kc.Observer(spin=camera.spin, inclination=camera.inclination)


def beyond_the_viewer(chance: np.random.Generator) -> tuple[Viewer, End]:
    """The celestial sphere, or a sphere outside the camera."""
    camera = random_camera(chance)
    if chance.uniform() < 0.6:
        return camera, end_of(camera, math.inf)
    return camera, end_of(camera, camera.radius * 20 ** float(chance.uniform(0.05, 1)))


def within_the_viewer(chance: np.random.Generator) -> tuple[Viewer, End]:
    """A sphere nearer to the hole than the viewer."""
    viewer = random_viewer(chance)
    low, high = 1.05 * kerr.horizon(viewer.spin), 0.95 * min(viewer.radius, 30.0)
    return viewer, end_of(viewer, low * (high / low) ** float(chance.uniform()))


def in_plane(chance: np.random.Generator) -> tuple[Viewer, End]:
    """A crossing of the plane."""
    return random_viewer(chance), EquatorialPlane(int(chance.integers(1, CROSSINGS + 1)))


KINDS: dict[str, Callable[[np.random.Generator], tuple[Viewer, End]]] = {
    "beyond the viewer": beyond_the_viewer,
    "within its radius": within_the_viewer,
    "in the plane": in_plane,
}


def drawn(kind: str, chance: np.random.Generator) -> Disc | None:
    """A random disc; None where the surface is refused."""
    viewer, end = KINDS[kind](chance)
    size = 10.0 ** float(chance.uniform(-7, math.log10(3)))
    order = int(chance.integers(1, 4)) if chance.uniform() < 0.5 else 0
    highest = int(chance.integers(0, HIGHEST + 1))
    try:
        place, length = centre(viewer, end, size, order, chance)
        began = time.perf_counter()
        seen = kc.magnification(viewer, place, length, max_index=highest, end=end)
    except ValueError:
        return None
    seconds = time.perf_counter() - began
    angle = length / end.radius if isinstance(end, Sphere) else length
    twin, twin_error = summed(viewer, end.vectors(np.array([place]))[0], angle, highest, surface=end)
    return Disc(
        kind=kind,
        spin=viewer.spin,
        viewer_radius=viewer.radius,
        inclination=math.degrees(viewer.inclination),
        end=repr(end),
        place=place,
        size=length,
        max_index=highest,
        at_caustic=order,
        total=seen.total,
        error=seen.error,
        certified=seen.certified,
        twin=twin,
        twin_error=twin_error,
        seconds=seconds,
        remarks=seen.remarks,
    )


def centre(
    viewer: Viewer, end: End, size: float, order: int, chance: np.random.Generator
) -> tuple[tuple[float, float], float]:
    """Centre and radius of a disc, beside the caustic of an order; 0 for anywhere, as where there is no such caustic.

    In the plane the radius grows with the distance from the hole, and any caustic will do: each crossing has few.
    """
    in_plane = isinstance(end, EquatorialPlane)
    curves = tuple(kc.caustics(viewer, HIGHEST + 1 if in_plane else order, end=end)) if order else ()
    if not curves:
        return _anywhere(viewer, end, size, chance)
    curve = curves[int(chance.integers(len(curves)))] if in_plane else curves[min(order, len(curves)) - 1]
    at = int(chance.integers(len(curve.place)))
    place, beside = curve.place[at], curve.place[(at + 1) % len(curve.place)]
    along = beside - place
    if in_plane:
        size = min(size * place[0], 0.9 * (place[0] - kerr.horizon(viewer.spin)))
        along[1] *= place[0]
        scale = np.array([1.0, 1 / place[0]])
    else:
        along[1] *= math.sin(place[0])
        scale = np.array([1.0, 1 / max(math.sin(place[0]), 1e-3)])
    normal = np.array([-along[1], along[0]]) / (math.hypot(*along) or 1.0)
    # Tangent from either side, on it, or somewhere about.
    eta = chance.choice([-1.0, 1.0, 0.0, float(chance.uniform(-3, 3))])
    place = place + eta * size * normal * scale
    if in_plane:
        return (float(place[0]), float(place[1])), size
    return (float(np.clip(place[0], 1e-3, math.pi - 1e-3)), float(place[1])), _length(size, end)


def _anywhere(viewer: Viewer, end: End, size: float, chance: np.random.Generator) -> tuple[tuple[float, float], float]:
    """Centre and radius of a disc, drawn without looking."""
    phi = float(chance.uniform(0, 2 * math.pi))
    if isinstance(end, EquatorialPlane):
        horizon = kerr.horizon(viewer.spin)
        radius = horizon * (20 / horizon) ** float(chance.uniform(0.05, 1))
        return (radius, phi), min(size * radius, 0.9 * (radius - horizon))
    return (math.acos(float(chance.uniform(-1, 1))), phi), _length(size, end)


def _length(angle: float, end: End) -> float:
    return angle * end.radius if isinstance(end, Sphere) else angle


def discs(kind: str, seed: int, count: int, stop: float) -> tuple[list[Disc], int]:
    """`count` discs of a kind, fewer where the clock says `stop` before; how many were refused."""
    chance = np.random.default_rng(seed)
    found: list[Disc] = []
    refused = 0
    while len(found) < count and time.perf_counter() < stop:
        disc = drawn(kind, chance)
        if disc is None:
            refused += 1
            continue
        found.append(disc)
    return found, refused


def picture(found: list[Disc]) -> Figure:
    """The figure of the study: relative errors by run time, reported ones as dots, differences as lines from these."""
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.7), layout="constrained")
        axes = figure.subplots(1, len(KINDS), sharey=True, sharex=True)
        for ax, kind in zip(axes, KINDS, strict=True):
            for verdict, (marker, colour) in LOOKS.items():
                chosen = [disc for disc in found if disc.kind == kind and disc.verdict == verdict and disc.total > 0]
                seconds = [disc.seconds for disc in chosen]
                errors = [max(disc.error / disc.total, 1e-15) for disc in chosen]
                dots = {"color": style.PALETTE[colour], "markersize": 3, "markeredgewidth": 0, "linestyle": "none"}
                ax.plot(seconds, errors, marker=marker, label=f"{verdict}: {len(chosen)}", **dots)
            ax.set(xscale="log", yscale="log", xlabel="run time (s)", title=kind)
            ax.legend(loc="upper left", markerscale=1.4)
        axes[0].set_ylabel("reported error, relative")
    return figure


def table(found: list[Disc]) -> str:
    """Counts of verdicts by kind of surface, and what one disc costs."""
    heads = [
        "sources",
        "discs",
        "certified",
        "wrong",
        "not certified, and beyond their error",
        "median s",
        "at caustics",
    ]
    lines = []
    for kind in KINDS:
        chosen = [disc for disc in found if disc.kind == kind]
        if not chosen:
            continue
        beside = [disc.seconds for disc in chosen if disc.at_caustic]
        lines.append(
            [
                kind,
                str(len(chosen)),
                str(sum(disc.certified for disc in chosen)),
                str(sum(disc.verdict == "wrong" for disc in chosen)),
                str(sum(not disc.certified and disc.beyond for disc in chosen)),
                f"{np.median([disc.seconds for disc in chosen]):.2g}",
                f"{np.median(beside):.2g}" if beside else "",
            ]
        )
    return markdown_table(heads, lines)


def findings(found: list[Disc]) -> list[str]:
    """Findings, in a sentence."""
    certified = [disc for disc in found if disc.certified]
    wrong = sum(disc.verdict == "wrong" for disc in found)
    honest = sum(disc.off <= disc.error + _TWIN_ERRORS * disc.twin_error for disc in certified)
    unknown = sum(not math.isfinite(disc.twin_error) for disc in certified)
    return [
        f"Of {len(found)} random sources {len(certified)} are certified, and {wrong} of these magnifications are "
        f"wrong: {honest - unknown} lie within both errors of the sum over rays, which was too coarse for {unknown}."
    ]


QUICK: dict[str, Any] = {"count": 1}
"""Arguments of `main` for a quick run."""


def main(output: Path, count: int = DISCS, seed: int = 1911, longest: float = math.inf) -> list[Path]:
    """Run the study; the files in `output`.

    count: discs of each kind; longest: seconds after which no disc is begun, a third of them for each kind.
    """
    began = time.perf_counter()
    found: list[Disc] = []
    refused = 0
    for step, kind in enumerate(KINDS):
        stop = began + longest * (step + 1) / len(KINDS)
        more, out = discs(kind, seed + step, count, stop)
        found, refused = found + more, refused + out
    text = table(found)
    print(text)
    return write_study(
        output,
        "extended_sources",
        __doc__ or "",
        picture(found),
        text,
        settings={"discs of each kind": count, "seed": seed},
        findings=findings(found),
        verdicts=Counter(disc.verdict for disc in found),
        refused=refused,
        exceptions=[asdict(disc) for disc in found if disc.verdict != "agree"],
        discs=[asdict(disc) for disc in found],
        seconds=time.perf_counter() - began,
    )
