"""Random cases of paths, gradients, pictures, volumes and patterns: claims hold, and a broken one is seen."""

from dataclasses import replace

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scripts import STUDIES

paths, gradients, patterns, pictures, volumes = (
    STUDIES.module(f"adversary.analyses.{name}") for name in ("paths", "gradients", "patterns", "pictures", "volumes")
)
MODULES = (paths, gradients, patterns, pictures, volumes)
# The true error is at most this many times the reported one.
HONEST = 10.0
# Cases with claims, by kind: the seeds of a few.
SEEDS = {
    "beams along paths": (2, 5),
    "paths of observers": (0, 1),
    "initial ellipses": (3, 10),
    "gradients of rays": (2,),
    "derivatives of images": (0,),
    "derivatives of caustics": (0,),
    "derivatives of events": (0,),
    "diffraction patterns": (0,),
    "screens and views": (4, 15),
    "frames with disks": (9, 12),
    "shutters": (0,),
    "volumes": (1,),
}
SLOW = ("gradients", "derivatives", "diffraction", "shutters", "frames", "volumes", "beams along", "initial")
KINDS = {name: kind for module in MODULES for name, kind in module.KINDS.items()}
CAMERA = kc.Camera(0.9, 7.0, 1.1, (0.1, -0.2, 0.3))
SKY = np.array([-0.3, 0.9, 0.3]) / np.linalg.norm([-0.3, 0.9, 0.3])
FIXED = kc.Camera(0.9, 7.0, 1.1, "fiducial")


def worst(claims) -> float:
    assert claims
    return max(claim.ratio for claim in claims)


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=pytest.mark.slow if kind.startswith(SLOW) else ()) for kind in KINDS]
)
def test_random_cases_keep_their_claims(kind):
    claims = [claim for seed in SEEDS[kind] for claim in KINDS[kind](np.random.default_rng((1, seed)))]
    assert worst(claims) <= HONEST, max(claims, key=lambda claim: claim.ratio)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("field", "name"), [("radius", "1 / radius"), ("theta", "direction"), ("time", "time"), ("jacobian", "diameters")]
)
def test_a_path_that_is_off_is_seen(field, name):
    found = kc.ray_paths(CAMERA, SKY, 9, beams=True)
    wrong = found
    if field == "jacobian":
        wrong = replace(found, beams=replace(found.beams, jacobian=found.beams.jacobian * (1 + 1e-9)))
    else:
        wrong = replace(found, **{field: getattr(found, field) * (1 + 1e-9)})
    for one, expected in ((found, set()), (wrong, {name})):
        claims = paths.path_claims(CAMERA, SKY, one, np.array([3, 6]), "")
        assert {claim.name for claim in claims if claim.ratio > HONEST} == expected


@pytest.mark.slow
def test_a_conjugate_point_that_is_off_is_seen():
    sky = np.array([-0.8, 0.8, 0.2]) / np.linalg.norm([-0.8, 0.8, 0.2])
    found = kc.ray_paths(FIXED, sky, 9, beams=True)
    assert found.index >= 1
    point = replace(found.conjugate, mino_time=found.conjugate.mino_time * (1 + 1e-8))
    for one, broken in ((found, False), (replace(found, conjugate=point), True)):
        claims = paths.path_claims(FIXED, sky, one, np.array([3]), "")
        off = [claim.ratio for claim in claims if claim.name == "conjugate point"]
        assert off and (max(off) > HONEST) == broken


def test_an_ellipse_that_is_off_is_seen():
    beam = kc.trace_beams(CAMERA, SKY)
    wrong = replace(beam, jacobian=beam.jacobian * (1 + 1e-9))
    for one, names in ((beam, set()), (wrong, {"diameters of an ellipse", "pulled back"})):
        claims = paths.ellipse_claims(CAMERA, SKY, np.inf, one, (0.4, 0.7), "")
        assert {claim.name for claim in claims if claim.ratio > HONEST} == names


def test_displacements_of_one_beam_are_pulled_back_as_those_of_many():
    """Beams of any shape, a single one included, whose Jacobian is not its own transpose."""
    sky = np.stack([SKY, [0.1, 0.9, 0.42], [0.3, -0.9, 0.3]])
    sky /= np.linalg.norm(sky, axis=1, keepdims=True)
    step = np.array([0.3, -0.7])
    many = kc.trace_beams(CAMERA, sky).pulled_back(sky, np.tile(step, (3, 1)))
    for n, tangent in zip(sky, many, strict=True):
        one = kc.trace_beams(CAMERA, n)
        assert np.allclose(one.pulled_back(n, step), tangent, rtol=1e-13)
        entries = np.stack(kc.tangent_basis(n)) @ tangent
        assert np.allclose(one.jacobian @ entries, step, atol=1e-10)


@pytest.mark.slow
def test_derivatives_that_are_off_are_seen():
    images = kc.star_images(FIXED, (1.4, 2.9), 1)
    found = kc.image_derivatives(FIXED, images)
    wrong = replace(found, time=found.time * (1 + 1e-6), sky=found.sky * (1 + 1e-6))
    for one, names in ((found, set()), (wrong, {"slopes of images", "slopes of times"})):
        claims = gradients.image_claims(images, one, 0, 0, "")
        assert {claim.name for claim in claims if claim.ratio > HONEST} == names
    slopes = gradients.slopes_of_rays("fiducial")
    assert worst(gradients.ray_claims(FIXED, images.sky[0], slopes)) < HONEST
    assert worst(gradients.ray_claims(FIXED, images.sky[0], lambda at: slopes(at) * (1 + 1e-8))) > HONEST


@pytest.mark.slow
def test_derivatives_of_curves_and_events_that_are_off_are_seen():
    found = kc.caustic_derivatives(FIXED, 1)[0]
    wrong = replace(found, cusps=found.cusps + 1e-3)
    assert worst(gradients.caustic_claims(FIXED, found, 1, 0)) < HONEST
    assert worst(gradients.caustic_claims(FIXED, wrong, 1, 0)) > HONEST
    events = kc.event_derivatives(FIXED, kc.pair_events(FIXED, 1.2, 1))
    assert worst(gradients.event_claims(FIXED, events, (1.2, 1), 0)) < HONEST
    assert worst(gradients.event_claims(FIXED, replace(events, azimuth=events.azimuth + 1e-3), (1.2, 1), 0)) > HONEST


def test_a_sky_that_is_off_is_seen():
    observer, screen = kc.Observer(0.9, 1.2), kc.Screen(24, 16, 3.0, (20.0, 5.0))
    sky = pictures.SmoothSky((0.6, 0.0, 0.8), (0.0, 1.0, 0.0))
    found = kc.render(observer, screen, sky.sky())
    assert worst(pictures.sky_claims(found, sky, False, "")) < HONEST
    assert worst(pictures.sky_claims(replace(found, light=found.light * 1.02), sky, False, "")) > HONEST


def test_coarse_pixels_are_means_over_what_they_see_of_a_disk():
    """Pixels that see the whole width of a disk, whose frequency ratio goes to 0 at its inner rim."""
    spiral = pictures.Spiral(2.05, 3.3, 3, 0.8, 1.0, "static")
    plain = spiral._replace(contrast=0.0)
    glow = replace(plain.disk(), emission=kc.disks.BlackBody(6504.0))
    for inclination, size, disk, law in ((1.4, (16, 12), spiral.disk(), spiral), (1.0, (8, 6), glow, plain)):
        camera = kc.Camera(0.95, 4.96, inclination, "fiducial")
        view = kc.pictures.View(*size, 1.0, forward=(-0.9, 0.1, 0.05))
        found = kc.render(camera, view, disk=disk, beaming=law is plain)
        wrong = replace(found, light=found.light * 1.2)
        ratios = [
            worst(pictures.disk_claims(one, law, law is plain, np.random.default_rng(3), "")) for one in (found, wrong)
        ]
        assert ratios[0] < 0.5 and ratios[1] > HONEST


@pytest.mark.slow
def test_light_of_a_volume_that_is_off_is_seen():
    cloud = volumes.Cloud(0.1, 4.0, 12.0, 0.3, 2, 6000.0, "fiducial")
    view = kc.pictures.View(8, 6, 0.1, forward=(-0.9, 0.4, 0.1))
    found = kc.pictures.render_volume(FIXED, view, cloud.volume(), beaming=True, colour_shift=True)
    assert worst(volumes.cloud_claims(found, cloud, (True, True), "")) < HONEST
    wrong = replace(found, light=found.light * 1.1)
    assert worst(volumes.cloud_claims(wrong, cloud, (True, True), "")) > HONEST


@pytest.mark.slow
def test_a_pattern_that_is_off_is_seen():
    pattern = kc.diffraction_pattern(kc.Camera(0.5, 16), ((1.5, 1.6), (3.1, 3.2)), 10.0, max_index=1, pixels=5)
    wrong = replace(pattern, real=pattern.real + 30 * pattern.error + 30 * pattern.error.max())
    assert (
        worst(patterns.pattern_claims(pattern, [7], "auto", ""))
        < HONEST
        < worst(patterns.pattern_claims(wrong, [7], "auto", ""))
    )
