"""Lessons of the explorer: what they say is what the package finds; the page's terms; the quiz and GIF files."""

import math
import re
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from exploring import evaluated
from PIL import Image

import kerrcaustics as kc
from kerrcaustics.explorer.answers import greeting
from kerrcaustics.explorer.lessons import LESSONS, TERMS
from kerrcaustics.explorer.page_script import PARTS
from kerrcaustics.explorer.state import PAGE

LESSON = {lesson.name: lesson for lesson in LESSONS}
GLOSSARY = Path(__file__).parents[1] / "docs" / "glossary.md"


def images_of(state):
    return kc.star_images(state.camera(), state.star(), state.max_index)


def apart(a, b):
    """Angles between directions, degrees."""
    return np.degrees(np.arccos(np.clip(a @ np.asarray(b).T, -1, 1)))


@pytest.mark.slow
@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.name)
def test_the_counts_of_lessons_are_certified(lesson):
    images = images_of(lesson.state)
    assert images.certified and tuple(images.per_index.values()) == lesson.per_index


@pytest.mark.slow
def test_two_images_lie_on_opposite_sides_and_the_mirror_image_fades():
    state = LESSON["Two images"].state
    near, far = images_of(state), images_of(replace(state, theta=state.theta - 40))
    out, _, up = axes(state)
    assert near.parity.tolist() == [1, -1] and near.magnification[0] > near.magnification[1] > far.magnification[1]
    assert np.prod(near.sky @ up) < 0
    assert (apart(far.sky, out) - apart(near.sky, out))[1] < 0


def axes(state):
    from kerrcaustics.spacetime.shadow import shadow_axes, shadow_edge

    return shadow_axes(state.camera(), shadow_edge(state.camera()))


@pytest.mark.slow
def test_a_star_behind_the_hole_is_two_bright_images_on_the_ring():
    state = LESSON["Einstein ring"].state
    images, ring = images_of(state), kc.caustics(state.camera(), 1)[0]
    assert max(ring.theta_extent, ring.phi_extent) < 1e-9
    # The star is half a degree from the caustic, and its images as far from the ring at most.
    assert images.magnification.min() > 10 and apart(images.sky, ring.sky).min(axis=1).max() < 0.5
    # Angles round the middle of the shadow differ by half a turn.
    flat = images.sky @ axes(state)[1:].T
    assert np.cos(np.subtract(*np.arctan2(*flat.T))) < -0.999


@pytest.mark.slow
def test_a_pair_is_born_where_the_star_enters_the_secondary_caustic():
    state = LESSON["A pair is born"].state
    secondary = kc.caustics(state.camera(), 2)[1]
    assert len(secondary.cusps) == 4
    images, outside = images_of(state), images_of(replace(state, theta=state.theta - 3))
    assert outside.certified and list(outside.per_index.values()) == [1, 1, 1]
    pair = [np.flatnonzero(images.index == k)[images.magnification[images.index == k].argmax()] for k in (1, 2)]
    # On both sides of the point of the critical curve whose place on the caustic is closest to the star.
    star = np.array([state.theta, state.phi])
    born = secondary.sky[np.abs((np.degrees(secondary.celestial) - star + 180) % 360 - 180).sum(axis=1).argmin()]
    to_birth, between = apart(images.sky[pair], born), apart(*images.sky[pair])
    assert between < 30 and abs(to_birth.sum() - between) < 0.1 * between
    assert apart(outside.sky, born).min() > to_birth.max()


@pytest.mark.slow
def test_three_images_meet_at_a_cusp():
    state = LESSON["A cusp"].state
    secondary = kc.caustics(state.camera(), 2)[1]
    cusp = min(secondary.cusps, key=lambda cusp: abs(np.degrees(cusp.celestial) - [state.theta, state.phi]).sum())
    assert 0 < state.phi - math.degrees(cusp.celestial[1]) < 1.5
    images, outside = images_of(state), images_of(replace(state, phi=state.phi - 3))
    close = apart(images.sky, cusp.sky) < apart(images.sky, cusp.sky).max() / 4
    assert sorted(images.index[close]) == [1, 2, 2]
    assert (apart(outside.sky, cusp.sky) < apart(images.sky, cusp.sky)[close].max()).sum() == 1


@pytest.mark.slow
def test_each_winding_of_the_tertiary_caustic_adds_a_pair():
    """The winding of the unwrapped curve round all copies of the star, by the angle that it turns through."""
    state = LESSON["Winding"].state
    secondary, tertiary = kc.caustics(state.camera(), 3)[1:]
    assert tertiary.circuits > 5

    def winding(caustic):
        theta, phi = np.degrees(caustic.celestial).T
        copies = state.phi + 360 * np.arange(-6, 3)
        z = (phi[:, None] - copies) + 1j * (theta[:, None] - state.theta)
        return np.abs(np.angle(np.roll(z, -1, axis=0) / z).sum(axis=0) / (2 * np.pi)).round().sum()

    assert winding(secondary) == 1 and winding(tertiary) == 6
    assert LESSON["Winding"].per_index == (1, 1 + 1, 1 + 1 + 6)


@pytest.mark.slow
def test_pairs_come_and_go_in_one_orbit():
    state = LESSON["One orbit"].state
    events = kc.pair_events(state.camera(), math.radians(state.theta), state.max_index)
    assert [event.kind for event in events if event.order == 2] == ["creation", "annihilation"]


def test_the_page_has_lessons_and_terms():
    record = greeting().record
    assert [lesson["name"] for lesson in record["lessons"]] == list(LESSON) and len(LESSONS) == 8
    assert record["lessons"][2]["count"] == "5 images: one of index 0, two of index 1, two of index 2."


def test_terms_are_those_of_the_glossary():
    text = GLOSSARY.read_text(encoding="utf-8")
    entries = re.findall(r"^(\w[^\n]*)\n((?:  [^\n]+\n)+)", text, re.MULTILINE)
    glossary = {name: " ".join(meaning.split()) for name, meaning in entries}
    for name, meaning in TERMS.items():
        assert glossary[name].startswith(meaning), name


def test_terms_on_the_page_have_a_meaning():
    script = "\n".join((PAGE / "parts" / f"{part}.js").read_text(encoding="utf-8") for part in PARTS)
    sliders = re.search(r"meaning = \{(.*?)\}", script)[1]
    used = set(re.findall(r'(?:\bterm\(|"data-term": |: )"([^"]+)"', sliders))
    used |= set(re.findall(r'(?:\bterm\(|"data-term": )"([^"]+)"', script))
    assert used <= set(TERMS) and len(used) >= 17


@pytest.mark.parametrize(
    ("counts", "pairs"), [([1, 1], [0, 0]), ([1, 2, 2], [0, 1, 0]), ([1, 2, 8], [0, 1, 6]), ([2, 2, 1], [1, 0, 0])]
)
def test_pairs_are_counted_by_order(counts, pairs):
    assert evaluated(f"return pairsOf({counts});") == pairs


def test_stars_of_the_quiz_lie_on_the_sphere_and_near_caustics():
    """Around a square caustic: most stars lie in its hull or close to it, and none is sought in a dot."""
    curve = {"celestial": [[80, 700], [80, 740], [100, 740], [100, 700]]}
    dot = {"celestial": [[30, 100], [30, 100.1], [30.1, 100.1], [30.1, 100]]}
    stars = evaluated(
        "let seed = 1; const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647;"
        f"return Array.from({{ length: 400 }}, () => quizStar([{curve}, {dot}], random));"
    )
    theta, phi = np.array([[star["theta"], star["phi"]] for star in stars]).T
    assert theta.min() >= 0.5 and theta.max() <= 179.5 and phi.min() >= 0 and phi.max() < 360
    near = (abs(theta - 90) <= 14) & (abs((phi % 360 + 180) % 360 - 180) <= 28)
    assert 0.6 < near.mean() < 0.95


def test_gif_files_hold_the_pictures_that_were_drawn():
    """Flat colours are kept exactly, in the order of the frames; noise makes the table of codes overflow."""
    generator = np.random.default_rng(1)
    colours = generator.integers(0, 32, (200, 3)) * 8
    pictures = colours[generator.integers(0, 200, (3, 60, 90))].astype(np.uint8)
    pictures[2, 10:] = pictures[1, 10:]
    flat = [np.dstack([picture, np.full((60, 90), 255, np.uint8)]).ravel().tolist() for picture in pictures]
    data = evaluated(
        f"const pictures = {flat}; const gif = new Gif(90, 60, new Palette(pictures), 4);"
        "pictures.forEach((picture) => gif.add(picture)); return [...gif.whole()];"
    )
    with Image.open(BytesIO(bytes(data))) as film:
        assert film.n_frames == 3 and film.info["duration"] == 40 and film.info["loop"] == 0
        for k, picture in enumerate(pictures):
            film.seek(k)
            assert np.array_equal(np.asarray(film.convert("RGB")), picture), k
