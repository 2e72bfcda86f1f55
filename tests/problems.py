"""Hard sources, each with what makes it hard: tests of images, discs, light curves and waves choose by these words."""

import math
from collections.abc import Callable, Collection
from typing import NamedTuple

import pytest

import kerrcaustics as kc

# What makes a problem hard. The tests hold the first four words against the caustics and the viewers.
WHY = {
    "fold": "a caustic of the orders that are searched crosses the source's limb, or a source that is a point",
    "ring": "the source covers a whole caustic, so that an image may be a ring",
    "far": "the viewer's radius is 500 M or more, and all images lie in a small part of its sky",
    "moving": "the viewer moves at a tenth of the speed of light or faster, or the source moves",
    "cusp": "the source lies on a cusp of a caustic",
    "axis": "the source lies next to the line through viewer and hole, in front of the hole or behind it",
    "grazing": "the source lies on the viewer's sphere, or crosses the rim, where rays touch its surface",
    "photon orbits": "the source lies within the photon orbits, or next to them",
    "thin layer": "the images lie in a thin layer at the shadow edge: high indices, second and third crossings",
    "small": "the source is so small that the rounding of its images counts",
}


class Problem(NamedTuple):
    """A source that is seen by a viewer.

    Attributes
    ----------
    why : str
        Words of WHY, with commas between.
    viewer : Camera or Observer
    place : tuple of floats, float, Orbit or callable
        Coordinates of the source's middle on its surface, as `magnification` takes them; of a body at rest, r, theta
        and phi; of another, an orbit, a radius or a function of time, as `light_curve` takes it.
    size : float
        Radius of the disc or the ball, as `magnification` and `light_curve` take it; 0 for points.
    end : float or EquatorialPlane
        The source's surface.
    max_index : int
        Highest Morse index of its images.
    time : float
        The viewer's time (M), of bodies.
    """

    why: str
    viewer: kc.Camera | kc.Observer
    place: tuple[float, ...] | float | kc.Orbit | Callable
    size: float = 0.0
    end: float | kc.EquatorialPlane = math.inf
    max_index: int = 2
    time: float = 0.0

    @property
    def tags(self) -> set[str]:
        """The words of WHY that hold."""
        return {word.strip() for word in self.why.split(",")}


EQUATORIAL = kc.Camera(0.999, 6.03)
NEAR = kc.Camera(0.9, 20.0, 1.2, "fiducial")
TILTED = kc.Camera(0.9, 10.0, 1.2, "fiducial")
FAR = kc.Camera(0.95, 1000.0, 1.3, "fiducial")
FARTHEST = kc.Camera(0.5, 3e5, 1.2, "static")
MOVING = kc.Camera(0.7, 10.0, 1.0, (0.1, 0.2, 0.4))
FAST = kc.Camera(0.9, 10.0, 1.2, (0.0, 0.3, 0.3))
STATIC = kc.Camera(0.0, 10.0)
INFINITE = kc.Observer(spin=0.9, inclination=1.1)
TOWARDS = kc.Camera(0.7, 14.0, 1.3, (0.1, -0.2, 0.3))
DISTANT = kc.Camera(0.9, 50.0, 1.0, "fiducial")
SLANTED = kc.Camera(0.9, 12.0, 1.3, "fiducial")
INCLINED = kc.Orbit.geodesic(8.0, 1.2, 0.3, (-0.05, 0.1, 0.35), time=3.0)
PLUNGING = kc.Orbit.geodesic(6.0, 1.4, 2.0, (-0.4, 0.05, 0.2))
AT_REST = kc.Camera(0.0, 10.0, 1.0, "fiducial")
# 0.3 from the axis through viewer and hole, about which the rays' directions turn by 1/30 over the ball.
BEHIND = (8.0, math.pi - 1 + 0.3 / 8, math.pi)
PLANE = [kc.EquatorialPlane(crossing) for crossing in (1, 2, 3)]


def retrograde(t: float) -> tuple[float, float, float]:
    """A circle against the spin."""
    return 10.0, math.pi / 2, 0.5 - 0.03 * t


DISCS = {
    "beside the hole": Problem("fold", EQUATORIAL, (1.2, 0.7), 0.1),
    "behind the hole": Problem("fold", EQUATORIAL, (1.2, 2.7), 0.1),
    "moving camera": Problem("ring, moving", FAST, (1.94, 3.14), 0.2, max_index=1),
    "Einstein ring": Problem("ring", STATIC, (math.pi / 2, math.pi), 0.3, max_index=1),
    "far": Problem("far", kc.Camera(0.4, 3e5, 1.3, "fiducial"), (1.2, 2.7), 0.2, max_index=0),
    "farther, fast hole": Problem("far", kc.Camera(0.999, 800.0, 1.3, "fiducial"), (1.2, 2.7), 0.003, max_index=0),
    "direction away from the hole": Problem("axis", SLANTED, (1.3, 0.02), 0.1, max_index=0),
    "sphere, on a caustic": Problem("fold", NEAR, (1.38, 4.58), 0.3 * 8.0, 8.0),
    "sphere, on the rim and a caustic": Problem("grazing, fold", NEAR, (1.4, 1.3), 0.3 * 8.0, 8.0),
    "sphere, direction to the hole": Problem("axis, fold", NEAR, (1.2, 0.05), 0.2 * 8.0, 8.0),
    "sphere, far": Problem("far", FAR, (1.5, 3.1), 0.2 * 10.0, 10.0, 1),
    "sphere, farthest": Problem("far, ring", FARTHEST, (1.8, 3.1), 0.3 * 20.0, 20.0, 1),
    "sphere, moving": Problem("moving, ring", MOVING, (2.0, 3.0), 0.3 * 7.0, 7.0),
    "sphere, next to photon orbits": Problem("photon orbits, fold", EQUATORIAL, (1.57, 3.0), 0.3 * 4.5, 4.5, 1),
    "sphere, from infinity": Problem("fold, ring", INFINITE, (1.9, 3.2), 0.3 * 10.0, 10.0),
    "sphere, within photon orbits": Problem("photon orbits", INFINITE, (1.1, 0.1), 0.3 * 1.5, 1.5, 0),
    "sphere of the viewer": Problem("grazing", SLANTED, (1.2, 2.7), 0.1 * 12.0, 12.0, 1),
    "sphere of the viewer, about it": Problem("axis, grazing", SLANTED, (1.25, 0.05), 0.2 * 12.0, 12.0, 1),
    "sphere of the viewer, at it": Problem("axis, grazing", SLANTED, (1.3, 0.01), 0.2 * 12.0, 12.0, 1),
    "plane": Problem("thin layer", NEAR, (7.0, 3.0), 1.0, PLANE[1]),
    "plane, third crossing": Problem("thin layer", NEAR, (5.0, 2.9), 0.5, PLANE[2]),
    "plane, on a caustic": Problem("fold", NEAR, (6.3013, -7.6124), 0.3, PLANE[1]),
    "plane, far": Problem("far", FAR, (6.0, 3.1), 2.0, PLANE[0]),
    "plane, moving": Problem("moving, thin layer", MOVING, (4.0, 3.3), 1.0, PLANE[1]),
    "plane, from infinity": Problem("thin layer", INFINITE, (6.0, 3.1), 0.5, PLANE[1], 1),
}

SMALL = {
    "sphere": Problem("small", NEAR, (1.4, 2.9), 1e-4, 8.0),
    "sphere, from infinity": Problem("small", INFINITE, (1.9, 3.2), 1e-4, 10.0),
    "sphere, moving": Problem("small, moving", MOVING, (1.4, 1.3), 1e-4, 7.0),
    "plane": Problem("small", NEAR, (8.0, 2.9), 1e-4, PLANE[0]),
    "plane, from infinity": Problem("small, thin layer", INFINITE, (6.0, 3.1), 1e-4, PLANE[1]),
    "plane, third crossing": Problem("small, moving, thin layer", MOVING, (5.0, 1.0), 1e-4, PLANE[2]),
}

POINTS = {
    "cusp": Problem("cusp, fold", kc.Camera(0.9, 4.0, 1.1, "fiducial"), (1.1, -2.9240115253812284), end=40.0),
    "fold": Problem(
        "fold", kc.Camera(0.998, 2.2, math.pi / 2, "fiducial"), (1.7226114646454945, 0.9431668670416595), end=30.0
    ),
    "falling in": Problem("thin layer, photon orbits", TILTED, (1.7, 3.1), end=1.46, max_index=4),
    "far source": Problem("thin layer, moving", kc.Camera(0.95, 200.0, 0.5, (0.1, 0.2, 0.3)), (2.3, 1.0), 0, 1000.0, 5),
}

BODIES = {
    "circular": Problem("moving", DISTANT, 8.0, 0.01, max_index=1, time=300.0),
    "retrograde": Problem("moving", TOWARDS, retrograde, 0.01, max_index=1, time=40.0),
    "inclined": Problem("moving", DISTANT, INCLINED, 0.01, max_index=1, time=150.0),
    "eccentric": Problem("moving", DISTANT, kc.Orbit.kepler(25.0, 0.6, 0.8, 0.2, 0.4), 0.01, max_index=1, time=200.0),
    "plunging": Problem("moving", TOWARDS, PLUNGING, 0.01, max_index=1, time=20.0),
    "at rest": Problem("moving", TOWARDS, (5.0, 0.6, 2.5), 0.01, max_index=1),
    "by the axis": Problem("axis", AT_REST, BEHIND, 0.01, max_index=1, time=100.0),
    "larger, by the axis": Problem("axis", AT_REST, BEHIND, 0.03, max_index=1, time=100.0),
    "larger, at rest": Problem("moving", TOWARDS, (5.0, 0.6, 2.5), 0.05, max_index=1, time=100.0),
}

TABLES = {"DISCS": DISCS, "SMALL": SMALL, "POINTS": POINTS, "BODIES": BODIES}


def each(
    table: dict[str, Problem],
    select: Callable[[Problem], bool] = lambda problem: True,
    slow: Collection[str] = (),
) -> pytest.MarkDecorator:
    """Run a test for each problem of a table that is selected, as its argument `problem`; those in `slow` are slow."""
    chosen = {name: problem for name, problem in table.items() if select(problem)}
    assert chosen and set(slow) <= set(chosen)
    marks = [pytest.mark.slow if name in slow else () for name in chosen]
    cases = [pytest.param(one, id=name, marks=mark) for (name, one), mark in zip(chosen.items(), marks, strict=True)]
    return pytest.mark.parametrize("problem", cases)


def in_motion(problem: Problem) -> bool:
    """True for sources that move."""
    return not isinstance(problem.place, tuple)


def magnified(problem: Problem):
    """The magnification of a disc."""
    return kc.magnification(problem.viewer, problem.place, problem.size, max_index=problem.max_index, end=problem.end)
