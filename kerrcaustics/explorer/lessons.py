"""Lessons of the explorer: stars to look at, each with an idea, what to look for and a count; and its terms."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from kerrcaustics.explorer.state import ExplorerState

_NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")


@dataclass(frozen=True)
class Lesson:
    """A star and a camera that show an idea.

    name: title of the lesson.
    state: the state of the page.
    idea: the idea, in two sentences.
    look_for: the thing to look for on the page.
    per_index: certified number of images of each Morse index.
    zoom: order of the caustic that fills the celestial sphere; 0 for the whole sphere.
    """

    name: str
    state: ExplorerState
    idea: str
    look_for: str
    per_index: tuple[int, ...]
    zoom: int = 0

    @property
    def count(self) -> str:
        """The number of images in words."""
        images = [f"{_NUMBERS[n]} of index {k}" for k, n in enumerate(self.per_index)]
        return f"{sum(self.per_index)} images: {', '.join(images)}."

    def record(self) -> dict[str, Any]:
        """The lesson as the page gets it."""
        texts = {"name": self.name, "idea": self.idea, "look_for": self.look_for, "count": self.count}
        return {**texts, "state": self.state.record(), "zoom": self.zoom}


LESSONS = (
    Lesson(
        "Two images",
        ExplorerState(spin=0.0, velocity="fiducial", orders=2, theta=60.0, phi=180.0),
        "A hole bends light, so a camera sees a star in more than one direction; this camera is at rest. Light that "
        "passes far from the hole makes the image of index 0; light that passes on the other side makes a fainter "
        "mirror image of index 1.",
        "the filled disk and the ring on opposite sides of the shadow. Drag the star away from the hole: the ring "
        "moves to the shadow and fades.",
        (1, 1),
    ),
    Lesson(
        "Einstein ring",
        ExplorerState(spin=0.0, velocity="fiducial", orders=2, theta=89.5, phi=180.0),
        "A hole without spin has a caustic that is one point: the place straight behind it. A star there is seen as a "
        "ring, the primary critical curve.",
        "two bright images on the ring, opposite each other. Move the star with the arrow keys round the place "
        "behind the hole: the images run round the ring.",
        (1, 1),
    ),
    Lesson(
        "A pair is born",
        ExplorerState(spin=0.5, orders=3, theta=84.6, phi=323.0),
        "With spin each caustic is a curve with four cusps. A star that enters it gains two images: a pair, born at "
        "one point of the critical curve.",
        "the images of index 1 and 2 on both sides of the secondary critical curve. Drag the star out of the "
        "secondary caustic and back: the pair meets, vanishes, and is born again with a flash.",
        (1, 2, 2),
        zoom=2,
    ),
    Lesson(
        "A cusp",
        ExplorerState(spin=0.5, orders=3, theta=90.0, phi=312.0),
        "A cusp is a sharp tip of a caustic. A star that enters through it gains a pair beside an image that is there "
        "already: three images lie close together.",
        "three images beside each other, two of one index and one between them. Drag the star out through the tip: "
        "one of the three is left.",
        (1, 2, 2),
        zoom=2,
    ),
    Lesson(
        "Winding",
        ExplorerState(spin=0.999, orders=3, theta=90.0, phi=72.0, chart="unwrapped"),
        "Near a rapidly spinning hole light circles before it leaves, and caustics are drawn out and wound up. The "
        "tertiary caustic runs more than five times round the sky, and each time that it winds round the star adds one "
        "pair.",
        "the stars on the unwrapped map: each copy of the star inside a caustic stands for one pair. Point at "
        "circuits in the table, and press show beside the caustic.",
        (1, 2, 8),
    ),
    Lesson(
        "One orbit",
        ExplorerState(spin=0.5, orders=3, theta=86.0, phi=270.0),
        "While the camera goes once round the hole, a star passes through all longitudes, in and out of the caustics.",
        "crosses on the camera sky where pairs are born and annihilated, once you press Play one orbit; in the strip "
        "below, two images become very bright at each of these moments. Drag the slider to one of the lines.",
        (1, 1, 1),
    ),
    Lesson(
        "A star of finite size",
        ExplorerState(spin=0.0, velocity="fiducial", orders=2, theta=88.0, phi=180.0, size=3.0),
        "A point on a caustic would be infinitely bright; a star is not a point. This one covers the place straight "
        "behind the hole: all of its images touch, and make a whole ring.",
        "the ring, and the magnification in the line below. Make the star smaller: the ring opens into two arcs. Make "
        "it larger: the ring is wider, but each part of the star is less bright.",
        (1, 1),
    ),
    Lesson(
        "Waves",
        ExplorerState(spin=0.5, orders=3, theta=84.6, phi=323.0, frequency=3.0),
        "Light is a wave, and the images of a star interfere. The strip below shows how strong the star's waves are at "
        "each frequency: the images beat, and the later one of them arrives, the faster they beat.",
        "the band about the line: the error, which grows toward long waves, because rays do not describe them. Drag "
        "the star over the caustic: its images flash there, the waves do not.",
        (1, 2, 2),
    ),
)
"""Presets by idea; one after the other they are the tour."""


TERMS = {
    "camera sky": "The sphere of all directions in which a camera can look.",
    "caustic": "The line on the celestial sphere that is seen along a critical curve: where the sheet of directions "
    "is folded. A star that crosses it gains or loses two images.",
    "celestial sphere": "The sphere of all directions far from the hole, where the stars are.",
    "certified": "Said of images: the number found equals the number given by an independent count.",
    "circuits": "The number of times a caustic runs round the celestial sphere.",
    "critical curve": "The line on the camera sky along which beams are squeezed to a line. Pairs of images are born "
    "on it. Its image on the celestial sphere is the caustic.",
    "cusp": "A sharp tip of a caustic. A star that passes through it loses or gains two images at the place of a "
    "third.",
    "error": "How far a number may be from the true one: an estimate, which tests compare with the true error.",
    "image": "A direction in which a camera sees a star. There are infinitely many, most of them faint and next to "
    "the shadow.",
    "inclination": "The angle between the spin axis and the direction from the hole to the camera: 90° on the equator.",
    "magnification": "The area of an image on the camera sky divided by the area of the star on the celestial sphere.",
    "Morse index": "The number of times a beam is squeezed to a line on its way: 0 for light that passes far from the "
    "hole. It is used to classify images.",
    "order": "Of a critical curve or caustic: 1 is primary, the outermost; 2 secondary; 3 tertiary; and so on, ever "
    "closer to the shadow.",
    "parity": "+1 for an image the same way round as the star, −1 for a mirror image. The two images of a pair have "
    "opposite parities.",
    "radius": "The distance from the hole, in units of its mass. For a hole without spin, it is the circumference of a "
    "circle there divided by 2π.",
    "redshift": "The frequency seen by the camera divided by that of the source: below 1 redder, above 1 bluer.",
    "shadow": "The directions from which no light comes: rays there, followed backward, fall into the hole.",
    "spin": "One of the two numbers that describe a hole: how strongly it drags space round, from 0 to just below 1. "
    "The other is its mass, the unit in which all lengths and times are measured.",
    "track": "The path of an image across the camera sky while the camera goes round the hole.",
    "velocity": "Of a camera: circular, on a free circular orbit in the equatorial plane; fiducial, at rest as far as "
    "the spinning space allows; static, at rest relative to the stars.",
    "winding": "The number of times a caustic runs round a star. It gives the number of a star's images without a "
    "search.",
}
"""Words with a meaning of their own, as the glossary has them."""


def lessons(tour: Sequence[Lesson] = LESSONS) -> dict[str, Any]:
    """Lessons and terms, as the page has them in its first message."""
    return {"lessons": [lesson.record() for lesson in tour], "terms": TERMS}
