"""Sources followed from viewer to viewer: through caustics of every surface, and against what beams foretell."""

import math

import numpy as np
import pytest
from parity import end_for, viewer_named

import kerrcaustics as kc

CELLS = [
    ("near", "sky"),
    ("near", "beyond"),
    ("near", "within"),
    ("near", "plane"),
    ("far", "within"),
    ("finite", "beyond"),
    ("finite", "plane"),
    ("infinity", "sky"),
    ("infinity", "within"),
    ("infinity", "plane"),
]


def _distance(place, others):
    """Angles (n,) from a place on a sphere to others."""
    (theta, phi), (other_theta, other_phi) = place, others.T
    cosine = math.cos(theta) * np.cos(other_theta)
    return np.arccos(np.clip(cosine + math.sin(theta) * np.sin(other_theta) * np.cos(other_phi - phi), -1, 1))


def across_a_fold(viewer, end, width):
    """Two places on both sides of the caustic of order 2, far from its cusps and ends, and from other caustics."""
    caustics = kc.caustics(viewer, 3, end=end)
    caustic = next(c for c in caustics if c.order == 2)
    plane = isinstance(end, kc.EquatorialPlane)
    middle = len(caustic.place) // 3
    if not plane:
        others = np.concatenate([c.place for c in caustics if c.order != 2])
        alone = np.array([_distance(here, others).min() for here in caustic.place])
        cusps = np.array([cusp.celestial for cusp in caustic.cusps]).reshape(-1, 2)
        alone = np.minimum(alone, [_distance(here, cusps).min(initial=9.0) for here in caustic.place])
        middle = 1 + int(np.argmax(alone[1:-1]))
    before, here, after = caustic.place[middle - 1 : middle + 2]
    # A length along phi' by one along the other coordinate.
    scale = here[0] if plane else math.sin(here[0])
    along = (after - before) * [1, scale]
    across = np.array([-along[1], along[0] / scale]) / np.hypot(*along)
    return here - width * across, here + width * across


@pytest.mark.slow
@pytest.mark.parametrize(("name", "surface"), CELLS, ids=lambda part: part)
def test_pair_is_created_and_annihilated_at_a_fold(name, surface):
    viewer, end = viewer_named(name), end_for(surface, name)
    one, other = across_a_fold(viewer, end, 0.02)
    sides = [kc.star_images(viewer, place, 2, end=end) for place in (one, other)]
    if len(sides[0]) > len(sides[1]):
        one, other, sides = other, one, sides[::-1]
    assert all(images.certified for images in sides) and len(sides[1]) == len(sides[0]) + 2
    followed = kc.follow_star([viewer] * 4, [one, one, other, one], 2, end=end)
    assert followed.certified
    created, annihilated = followed.created[2], followed.annihilated[3]
    assert followed.images[2].index[list(created)].tolist() == [1, 2]
    assert created == annihilated
    assert [len(new) for new in followed.created] == [0, 0, 2, 0]
    assert [len(gone) for gone in followed.annihilated] == [0, 0, 0, 2]
    # The pair lies closer together than images of these indices did before it came.
    assert followed.followed[1].all()
    assert followed.before[3][followed.before[2][np.setdiff1d(np.arange(len(sides[1])), created)]].tolist() == [
        i for i in range(len(sides[1])) if i not in created
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "surface"), CELLS, ids=lambda part: part)
def test_linked_images_move_as_their_beams_foretell(name, surface):
    """By J^-1 times the step of the source, up to its square."""
    viewer, end = viewer_named(name), end_for(surface, name)
    step, start = np.array([3e-5, -2e-5]), np.array((8.0, 2.9) if surface == "plane" else (1.4, 2.9))
    followed = kc.follow_star([viewer] * 2, [start, start + step], 1, end=end)
    first, second = followed.images
    assert (
        len(first) > 0
        and followed.followed[1].all()
        and np.array_equal(np.sort(followed.before[1]), [*range(len(first))])
    )
    for leaf in np.unique(first.second_arrival):
        which = np.flatnonzero(first.second_arrival == leaf)
        there = first.surface.at_second_arrival() if leaf else first.surface
        beams = kc.trace_beams(viewer, first.sky[which], end=there)
        lengths = step * [1, start[0] if surface == "plane" else math.sin(start[0])]
        moved = np.linalg.solve(beams.jacobian, lengths)
        if viewer.sky_coordinates == "alpha, beta":
            shift = moved[:, ::-1]
        else:
            e_1, e_2 = kc.tangent_basis(first.sky[which])
            shift = moved[:, :1] * e_1 + moved[:, 1:] * e_2
        back = np.argsort(followed.before[1])[which]
        true = second.sky[back] - first.sky[which]
        assert (np.linalg.norm(true - shift, axis=1) < 1e-3 * np.linalg.norm(shift, axis=1)).all()


@pytest.mark.slow
def test_camera_falls_through_the_radius_of_the_star():
    """Once the star is beyond it, once within: the same images, but for what is next to the camera."""
    cameras = [kc.Camera(0.9, radius, 1.2, (-0.1, 0.0, 0.0)) for radius in (20.02, 20.01, 19.99, 19.98)]
    followed = kc.follow_star(cameras, (1.0, 2.0), 1, end=20.0)
    assert followed.certified and not any(followed.created) and not any(followed.annihilated)
    for last, images, before, sure in zip(
        followed.images[:-1], followed.images[1:], followed.before[1:], followed.followed[1:], strict=True
    ):
        assert sure.all() and np.array_equal(last.index[before], images.index)
        assert np.linalg.norm(images.sky - last.sky[before], axis=1).max() < 2e-3
        assert np.abs(images.time - last.time[before]).max() < 0.05


@pytest.mark.slow
def test_far_camera_follows_as_the_observer_does():
    """At 1e6 both search one screen: the same links."""
    steps = [1.2, 1.21, 1.22]
    cameras = [kc.Camera(0.9, 1e6, inclination, "fiducial") for inclination in steps]
    observers = [kc.Observer(spin=0.9, radius=1e6, inclination=inclination) for inclination in steps]
    for end, star in ((7.0, (1.4, 2.9)), (kc.EquatorialPlane(2), (8.0, 2.9))):
        one, other = (kc.follow_star(viewers, star, 2, end=end) for viewers in (cameras, observers))
        assert [link.tolist() for link in one.before] == [link.tolist() for link in other.before]
        assert all(sure.all() for sure in one.followed[1:])


@pytest.mark.slow
def test_remarks_name_the_camera():
    observers = [kc.Observer(spin=0.9, inclination=inclination) for inclination in (1.0, 1.01)]
    followed = kc.follow_star(observers, (1.4, 2.9), 1)
    assert followed.certified
    assert [remark.split(":")[0] for remark in followed.remarks] == ["camera 0", "camera 1"]


@pytest.mark.parametrize(
    ("cameras", "star", "end", "words"),
    [
        ([kc.Camera(0.9, 10.0)], (8.0, 2.9), kc.EquatorialPlane(1), "`cameras` must not lie in the equatorial plane"),
        ([kc.Camera(0.9, 10.0, 1.0), "Gargantua"], (1.0, 2.0), math.inf, "`cameras` must hold .* item 1 is str"),
        (
            [kc.Camera(0.9, 10.0, 1.0), kc.Observer(spin=0.9, inclination=1.0)],
            (1.0, 2.0),
            math.inf,
            "`cameras` must hold either",
        ),
        ([kc.Observer(spin=0.9, inclination=1.0)], (1.0, 2.0), 1.0, "`end` must be larger than the horizon"),
        ([kc.Camera(0.9, 10.0, 1.0)], (1.0, 2.0), kc.EquatorialPlane(1), "`star` must have an r larger"),
    ],
)
def test_bad_arguments_are_named(cameras, star, end, words):
    with pytest.raises(ValueError, match=f"^Argument {words}"):
        kc.follow_star(cameras, star, 1, end=end)
