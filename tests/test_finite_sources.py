"""Sources on spheres of finite radius: beyond the camera, within its radius, and on it."""

import json
import math
from pathlib import Path

import numpy as np
import problems
import pytest
from command_line import run

import kerrcaustics as kc
from kerrcaustics.beams.ends import Sphere
from kerrcaustics.images.sheets import sheets_of
from kerrcaustics.lens_map.domains import domain_of
from kerrcaustics.spacetime.frame import photon_of, sky_from_fido
from kerrcaustics.spacetime.sphere import flattened, from_angles, moved

KERRP2P = json.loads((Path(__file__).parent / "data" / "kerrp2p_near_source.json").read_text())
CAMERA = kc.Camera(0.9, 10.0, 1.2, "fiducial")
# Of the same images, by Newton's method in 50 digits: index, b, q, time.
LONG_ARITHMETIC = [
    (4, -0.7080010282395184, 26.13866612311401, 1084.5116254756551),
    (5, -0.6341477449833919, 25.98871008301, 1097.4236617180752),
    (6, 0.723713611022987, 21.067682367767038, 1113.2030328446883),
]
STARS = [(0.6, 2.0), (1.7, 3.1), (2.6, 5.5)]


def test_lines_meet_the_rim_where_rays_turn_on_the_sphere():
    """On both sides of the rim R(r) of the line's rays vanishes at the sphere's radius, as the square of the depth."""
    radius, turn = 6.0, np.linspace(0, 6, 7)
    source = domain_of(Sphere(radius), CAMERA.at_rest())
    depth = np.linspace(0.5, 6, 4001)
    for t in turn:
        line_of_sight, second_arrival = source.line_of_sight(np.full_like(depth, t), depth)
        fold = int(np.argmax(second_arrival))
        assert 0 < fold < len(depth)
        light = photon_of(source.camera.frame(), tuple(sky_from_fido(source.camera.frame(), -line_of_sight).T))
        square = radius**2 + CAMERA.spin**2
        potential = (square - CAMERA.spin * light.b) ** 2 - (square - 2 * radius) * light.kappa
        assert (potential[[0, -1]] > 0).all() and (potential > -1e-8).all()
        # Quadratic about its zero: two steps away it is four times as large as one step away.
        assert potential[fold + 20] == pytest.approx(potential[fold - 20], rel=0.2)
        assert potential[fold + 40] == pytest.approx(4 * potential[fold + 20], rel=0.2)


def test_spheres_among_the_photon_orbits_are_refused():
    for function in (
        lambda: kc.caustics(CAMERA, 1, end=2.5),
        lambda: kc.star_images(kc.Camera(0.9, 3.0, 1.2, "fiducial"), STARS[0], 0, end=2.0),
        lambda: kc.count_map(CAMERA, 0, end=2.5),
    ):
        with pytest.raises(ValueError, match="Argument `end` must be"):
            function()


@pytest.mark.parametrize(
    ("wrong", "complaint"),
    [
        ({"end": 1.2}, "`end` must be larger than the horizon"),
        ({"end": math.nan}, "`end` must be a radius"),
        ({"end": "far"}, "`end` must be a radius"),
    ],
)
def test_ends_that_are_none(wrong, complaint):
    for function in (kc.star_images, kc.image_counts):
        with pytest.raises(ValueError, match=complaint):
            function(CAMERA, STARS[0] if function is kc.star_images else STARS, **wrong)
    with pytest.raises(ValueError, match="`level` must lie between 0 and pi for a star within the camera's radius"):
        kc.star_tracks(kc.Camera(0.9, 10.0), 0.0, end=5.0)


def test_command_line_refuses_an_end_inside_the_horizon(capsys):
    camera = ["--spin", "0.8", "--radius", "10"]
    for command in (["images", "--star", "17", "-45"], ["caustics"], ["counts", "--map"]):
        code, out, err = run(capsys, *command, *camera, "--source-radius", "1.2")
        assert code == 2
        assert (
            out == "" and err.count("\n") == 1 and "--source-radius must be larger than the horizon radius 1.6" in err
        )


@pytest.mark.slow
def test_images_of_a_near_source_that_kerrp2p_published():
    """The source's place as a camera, time reversed: azimuth -45 degrees."""
    camera = kc.Camera(KERRP2P["spin"], KERRP2P["source_radius"], math.radians(KERRP2P["source_theta_deg"]), "fiducial")
    star = math.radians(KERRP2P["observer_theta_deg"]), -math.radians(KERRP2P["observer_phi_deg"])
    images = kc.star_images(camera, star, 6, end=KERRP2P["observer_radius"])
    assert images.certified and list(images.per_index.values()) == [1] * 7
    light = photon_of(camera.frame(), tuple(images.sky.T))
    for half_orbits, sign_r, sign_theta, b, q, time in KERRP2P["rows"]:
        i = int(np.argmin(np.abs(light.b - b) + np.abs(light.q - q)))
        assert images.index[i] == math.floor(half_orbits)
        assert [np.sign(images.sky[i, 0]), -np.sign(images.sky[i, 2])] == [sign_r, sign_theta]
        # The published numbers themselves are off by so much for the last image: see the next test.
        assert light.b[i] == pytest.approx(b, abs=1e-9)
        assert light.q[i] == pytest.approx(q, abs=1e-8)
        assert images.time[i] == pytest.approx(time, abs=1e-8)
    for index, b, q, time in LONG_ARITHMETIC:
        i = int(np.argmin(np.abs(images.index - index)))
        assert [light.b[i], light.q[i], images.time[i]] == pytest.approx(
            [b, q, time], rel=0, abs=1e-12 * images.time[i]
        )
        assert images.error[i] < 1e-12 and abs(images.time[i] - time) < 2 * images.time_error[i]


@pytest.mark.slow
def test_all_images_of_that_source_by_newton_s_method_with_the_integrator():
    """Seven to index 6: no others are to be found in the rows that are not stored. Each within both error bars."""
    camera = kc.Camera(KERRP2P["spin"], KERRP2P["source_radius"], math.radians(KERRP2P["source_theta_deg"]), "fiducial")
    star = math.radians(KERRP2P["observer_theta_deg"]), -math.radians(KERRP2P["observer_phi_deg"])
    end, goal = KERRP2P["observer_radius"], from_angles(*star)
    images = kc.star_images(camera, star, 6, end=end)
    assert images.certified and images.index.tolist() == list(range(7))

    def integrated(sky):
        return kc.trace_beams(camera, sky, "integrated", 1e-13, end=end, time=True)

    def to_star(beams):
        return flattened(beams.direction, goal - beams.direction)

    # From images of a star next to it.
    beams = integrated(images.sky)
    sky = moved(images.sky, beams.pulled_back(images.sky, np.full((7, 2), 1e-5)))
    assert (np.linalg.norm(to_star(integrated(sky)), axis=1) > 1e-6).all()
    for _ in range(6):
        beams = integrated(sky)
        sky = moved(sky, beams.pulled_back(sky, to_star(beams)))
    beams = integrated(sky)
    # N itself is rounded, which the beam magnifies.
    blur = beams.error + 2.3e-16 * beams.delta_plus
    assert (np.linalg.norm(to_star(beams), axis=1) <= blur).all()
    assert (np.linalg.norm(sky - images.sky, axis=1) <= blur / np.abs(beams.delta_minus) + images.error).all()
    assert (np.abs(beams.time - images.time) <= beams.time_error + images.time_error).all()
    np.testing.assert_array_equal(beams.index, images.index)
    light, other = (photon_of(camera.frame(), tuple(n.T)) for n in (sky, images.sky))
    np.testing.assert_allclose(light.b, other.b, rtol=0, atol=1e-10)
    np.testing.assert_allclose(light.q, other.q, rtol=0, atol=1e-9)


# Of points of the table: images of the highest index, N and time, by Newton's method in 50 digits.
DEEP = {
    "falling in": [
        ([-0.9637740600047865, -0.26494504529083474, 0.030719443968399655], 110.41806682462895),
        ([-0.9566945970587004, -0.24322736136862189, -0.15992466551582565], 93.48176396475293),
        ([-0.9333172690399605, -0.15519321439041867, 0.32378069973202483], 76.78701095751626),
        ([-0.9218799071756297, -0.10376283880157608, -0.3733238674792847], 80.71925658741407),
    ],
    "far source": [([-0.9741388236233354, 0.11494496293772505, -0.19452816712494206], 1288.9635994583202)],
}


@pytest.mark.slow
@pytest.mark.parametrize("name", DEEP)
def test_images_next_to_the_shadow_edge_are_known_to_round_off(name):
    problem, true = problems.POINTS[name], DEEP[name]
    images = kc.star_images(problem.viewer, problem.place, problem.max_index, end=problem.end)
    assert images.certified and (images.index == problem.max_index).sum() == len(true)
    for sky, time in true:
        away = np.linalg.norm(images.sky - sky, axis=1)
        i = int(np.argmin(away))
        assert images.index[i] == problem.max_index and away[i] < 2e-14 and away[i] <= images.error[i] < 1e-13
        assert abs(images.time[i] - time) < images.time_error[i] < 1e-11


@pytest.mark.slow
def test_far_sources_tend_to_those_at_infinity():
    """As 1 / r: caustics, and the images of a star."""
    limit, far, farther = (kc.caustics(CAMERA, 2, end=end) for end in (math.inf, 1e5, 1e6))
    for i in range(2):
        gap, closer = (abs(c[i].phi_min - limit[i].phi_min) for c in (far, farther))
        assert closer < 1e-4 and gap == pytest.approx(10 * closer, rel=1e-3)
    limit, far, farther = (kc.star_images(CAMERA, STARS[1], 2, end=end).sky for end in (math.inf, 1e5, 1e6))
    gap, closer = (np.linalg.norm(sky - limit, axis=1) for sky in (far, farther))
    np.testing.assert_allclose(gap, 10 * closer, rtol=1e-3)


@pytest.mark.slow
def test_no_jump_at_the_camera_s_radius():
    radius, step = CAMERA.radius, 1e-5
    below, at, above = (kc.caustics(CAMERA, 2, end=end) for end in (radius - step, radius, radius + step))
    for i in range(2):
        for name in ("theta_min", "phi_min", "phi_max"):
            low, middle, high = (getattr(c[i], name) for c in (below, at, above))
            assert abs(high - low) < 100 * step and middle == pytest.approx((low + high) / 2, abs=1e-9)
    for star in STARS:
        below, at, above = (kc.star_images(CAMERA, star, 2, end=end) for end in (radius - step, radius, radius + step))
        assert below.certified and at.certified and above.certified
        np.testing.assert_array_equal(below.index, above.index)
        assert np.abs(above.sky - below.sky).max() < 10 * step
        np.testing.assert_allclose((below.sky + above.sky) / 2, at.sky, atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("end", [12.0, 10.0, 9.9, 5.0, 1.46], ids=str)
def test_counts_of_images_that_are_found_are_those_of_the_caustics(end):
    """Within the camera's radius the images come from changed places, the counts from its own caustics."""
    found = kc.image_counts(CAMERA, STARS, 2, end=end)
    reported = kc.image_counts(CAMERA, STARS, 2, end=end, find=False)
    assert found.certified.all()
    np.testing.assert_array_equal(found.counts, reported.counts)


@pytest.mark.slow
@pytest.mark.parametrize("end", [12.0, 5.0, 1.7], ids=str)
def test_images_lead_to_their_star(end):
    """By the integrator, and with the index that it counts."""
    moving = kc.Camera(0.9, 10.0, 1.2, (0.2, -0.3, 0.1))
    for star in STARS:
        images = kc.star_images(moving, star, 2, end=end)
        for leaf in (False, True):
            here = np.zeros(len(images), bool) if images.second_arrival is None else images.second_arrival
            here = here == leaf
            if not here.any():
                continue
            beams = kc.trace_beams(moving, images.sky[here], "integrated", end=Sphere(end, leaf), time=True)
            np.testing.assert_allclose(np.cos(beams.azimuth), math.cos(star[1]), atol=1e-7)
            np.testing.assert_allclose(beams.direction[:, 2], math.cos(star[0]), atol=1e-7)
            np.testing.assert_array_equal(beams.index, images.index[here])
            np.testing.assert_allclose(beams.time, images.time[here], rtol=1e-8)


@pytest.mark.slow
def test_tracks_and_events_at_a_finite_radius():
    camera = kc.Camera(0.9, 10.0)
    tracks = kc.star_tracks(camera, 1.2, 2, end=12.0)
    assert tracks.certified and len(tracks.events) == 2
    single = kc.star_images(camera, (1.2, 2.0), 2, end=12.0)
    together = tracks.images_at(azimuth=2.0)
    np.testing.assert_allclose(together.sky, single.sky, atol=1e-10)
    within = kc.pair_events(camera, 1.2, 2, end=5.0)
    for event in within:
        sides = [kc.star_images(camera, (1.2, event.star[1] + step), 2, end=5.0) for step in (-1e-3, 1e-3)]
        assert all(side.certified for side in sides)
        assert abs(len(sides[1]) - len(sides[0])) == (2 if event.order <= 2 else 1)


@pytest.mark.slow
@pytest.mark.parametrize(("camera", "theta", "end"), [(kc.Camera(0.9, 10.0), 1.2, 5.0), (CAMERA, 2.0, 8.0)], ids=str)
def test_tracks_of_a_star_within_the_camera_s_radius(camera, theta, end):
    """Every point leads to the star by the integrator; there are as many as single searches find."""
    tracks = kc.star_tracks(camera, theta, 2, end=end)
    assert tracks.certified and tracks.tracks
    assert [e.azimuth for e in tracks.events] == [e.azimuth for e in kc.pair_events(camera, theta, 2, end=end)]
    passed = np.zeros(5, int)
    moments = np.array([0.3, 1.9, 3.0, 4.1, 5.6])
    for track in tracks.tracks:
        plain = np.flatnonzero(track.parity != 0)[::5]
        ends = [
            kc.trace_beams(camera, track.sky[plain], "integrated", 1e-12, end=Sphere(end, leaf))
            for leaf in (False, True)
        ]
        goal = from_angles(np.full(len(plain), theta), track.azimuth[plain])
        misses = [np.nan_to_num(np.linalg.norm(one.direction - goal, axis=1), nan=9.0) for one in ends]
        assert np.minimum(*misses).max() < 1e-7
        index = np.where(misses[0] < misses[1], *(np.asarray(one.index) for one in ends))
        np.testing.assert_array_equal(index, track.index[plain])
        whole = (
            np.append(track.azimuth, track.azimuth[0] + 2 * math.pi * track.turns) if track.closed else track.azimuth
        )
        turns = np.floor((whole - moments[:, None]) / (2 * math.pi))
        passed += np.abs(np.diff(turns, axis=1)).sum(axis=1).astype(int)
        assert (np.linalg.norm(np.diff(track.sky, axis=0), axis=1) < 0.05).all()
    together = tracks.images_at(azimuth=moments)
    assert all(images.certified for images in together)
    assert passed.tolist() == [len(images) for images in together]
    single = kc.star_images(camera, (theta, 1.9), 2, end=end)
    np.testing.assert_allclose(together[1].sky, single.sky, atol=1e-12)


def test_sheets_know_their_sphere():
    with pytest.raises(ValueError, match="between them lie photon orbits"):
        sheets_of(CAMERA, 0, Sphere(2.5))


@pytest.mark.parametrize("radius", [1.5, 6.0])
def test_lines_are_followed_as_far_down_as_doubles_reach(radius, recwarn):
    """Far below all depths that a direction can resolve, where a search may look, they end on the shadow edge."""
    camera = CAMERA.at_rest()
    depth = np.array([1.0, 30.0, 700.0, 1500.0])
    line_of_sight = domain_of(Sphere(radius), camera).line_of_sight(np.full(4, 0.7), depth)[0]
    assert (
        np.isfinite(line_of_sight).all()
        and line_of_sight[2] == pytest.approx(line_of_sight[3], abs=1e-15)
        and not recwarn.list
    )


@pytest.mark.slow
@pytest.mark.parametrize("offset", [1.1, 1.01, 0.999])
def test_limb_next_to_a_caustic_that_is_a_point(offset):
    # Next to the axis the images of index 2 are arcs of half a ring, 1e-6 rad thick.
    camera, size = kc.Camera(0.0, 10.0, velocity="fiducial"), math.radians(3)
    seen = kc.magnification(camera, (math.pi / 2, math.pi + offset * size), size)
    assert seen.certified
    assert seen.error < 1e-8 * seen.total
    # The hole is round: the way aside does not matter.
    turned = kc.magnification(camera, (math.pi / 2 - offset * size, math.pi), size)
    assert abs(seen.total - turned.total) < seen.error + turned.error
