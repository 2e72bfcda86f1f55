"""Arguments of another branch: a public function that takes one of several ways refuses what only the others use."""

import inspect

import numpy as np
import pytest
from command_line import run
from public import PUBLIC

import kerrcaustics as kc

CAMERA = kc.Camera(0.9, 10.0, 1.2)
STAR = (1.4, 2.9)
# Of images all arrivals are found.
SECOND = {"end": kc.Sphere(5.0, second_arrival=True)}
RINGS = kc.photon_rings(kc.Observer(spin=0.9, inclination=1.0), max_order=1)
VIEW = kc.pictures.View(8, 8, 1.0)
LIGHT = np.ones((4, 8, 3))
OF_SPOTS = {"crossings": 4}
# Parameters that choose one of several ways.
CHOICES = {
    "source",
    "method",
    "kind",
    "profile",
    "engine",
    "velocity",
    "motion",
    "curve",
    "projection",
    "end",
    "sky",
    "disk",
}


def light_curve(source, **settings):
    return kc.light_curve(CAMERA, 8.0, 3, source=source, **settings)


REFUSED = {
    "light_curve": [
        *((lambda n=n, v=v: light_curve("point", **{n: v}), n) for n, v in {**OF_SPOTS, "size": 0.1}.items()),
        *((lambda n=n, v=v: light_curve("ball", **{n: v}), n) for n, v in OF_SPOTS.items()),
        (lambda: light_curve("spot", max_index=2), "max_index"),
        (lambda: light_curve("spot", searches=10), "searches"),
        (lambda: light_curve(None, max_index=99), "max_index"),
        (lambda: kc.light_curve(CAMERA, kc.Orbit.kepler(40.0), 3, crossings="banana"), "crossings"),
        (lambda: light_curve(kc.Ball(), size=0.1), "size"),
        (lambda: light_curve(kc.Ball(), crossings=1), "crossings"),
        (lambda: light_curve(kc.Spot(), crossings=1), "crossings"),
        (lambda: light_curve(kc.Spot(), max_index=1), "max_index"),
        (lambda: light_curve("point", size=-1.0), "size"),
    ],
    "line_profile": [(lambda: kc.line_profile(CAMERA, 4.0, 8.0, tolerance=0.1, radii=8, turns=8), "tolerance")],
    "ring_visibility": [(lambda: kc.ring_visibility(RINGS, 1.0, 0.0, motion="plunging"), "motion")],
    "tone_mapped": [(lambda: kc.pictures.tone_mapped(LIGHT, softening=30.0), "softening")],
    "auto_exposure": [(lambda: kc.pictures.auto_exposure(LIGHT, softening=10.0), "softening")],
    "magnification": [
        (lambda: kc.magnification(CAMERA, STAR, 0.01, power=4.0, end=30.0), "power"),
        (lambda: kc.magnification(CAMERA, STAR, 0.01, profile=("uniform", 0.3)), "profile"),
        (lambda: kc.magnification(CAMERA, STAR, 0.01, **SECOND), "end"),
    ],
    "count_map": [
        (lambda: kc.count_map(CAMERA, radii=[5.0, 6.0]), "radii"),
        (lambda: kc.count_map(CAMERA, **SECOND), "end"),
    ],
    "image_counts": [(lambda: kc.image_counts(CAMERA, [STAR], **SECOND), "end")],
    "star_images": [(lambda: kc.star_images(CAMERA, STAR, **SECOND), "end")],
    "star_tracks": [(lambda: kc.star_tracks(CAMERA, 1.4, **SECOND), "end")],
    "pair_events": [(lambda: kc.pair_events(CAMERA, 1.4, **SECOND), "end")],
    "follow_star": [(lambda: kc.follow_star([CAMERA], STAR, **SECOND), "end")],
    "circle_images": [(lambda: kc.circle_images(CAMERA, [0.0, 0.0, 1.0], **SECOND), "end")],
    "caustics": [(lambda: kc.caustics(CAMERA, **SECOND), "end")],
    "caustic_derivatives": [(lambda: kc.caustic_derivatives(CAMERA, **SECOND), "end")],
    "render": [
        (lambda: kc.render(CAMERA, VIEW, sky_radius=50.0), "sky_radius"),
        (lambda: kc.render(CAMERA, VIEW, kc.skies.Checkerboard(), delay=True), "delay"),
    ],
    "trace_view": [
        (lambda: kc.pictures.trace_view(CAMERA, VIEW, sky=False, sky_radius=50.0), "sky_radius"),
        (lambda: kc.pictures.trace_view(CAMERA, VIEW, delay=True), "delay"),
    ],
    "amplification": [
        (lambda: kc.amplification(CAMERA, (8.0, 1.0), 1.0, end=kc.EquatorialPlane(2)), "end"),
        (lambda: kc.amplification(CAMERA, STAR, 1.0, **SECOND), "end"),
    ],
}
# Functions with a choice of which each way uses all of the other arguments.
ALL_USED = {
    "Beams", "Camera", "Caustic", "Checkerboard", "Disk", "Orbit", "OrbitingSpots", "Panorama", "Rays", "StarField",
    "Spot", "StarImages", "TurnedSky", "View", "Volume", "celestial_picture", "clipped_fraction", "explore",
    "isoradials", "ray_paths", "render_volume", "trace_beams", "trace_rays",
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_an_argument_of_another_branch_is_refused(name):
    for call, argument in REFUSED[name]:
        with pytest.raises(ValueError, match=rf"^Argument `{argument}` must ") as caught:
            call()
        assert "\n" not in str(caught.value)


def test_every_public_function_with_branches_is_listed():
    with_choice = {
        name for name, item in PUBLIC.items() if callable(item) and CHOICES & set(inspect.signature(item).parameters)
    }
    assert with_choice - {"Status"} == set(REFUSED).union(ALL_USED) & with_choice
    assert not set(REFUSED) & ALL_USED


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ["--source", "point", "--motion", "retrograde"],
            "--motion must be left out for a point, as only a spot has it",
        ),
        (["--source", "ball", "--power", 3], "--power must be left out for a ball, as only a spot has it"),
        (["--source", "point", "--size", 0.1], "--size must be left out for a point, as only a ball or a spot has it"),
        (["--max-index", 1], "--max-index must be left out for a spot, as only a point or a ball has it"),
    ],
)
def test_the_command_refuses_options_of_other_sources(capsys, options, message):
    status, _, err = run(
        capsys, "light-curve", "--spin", 0.9, "--radius", 50, "--inclination", 60, "--orbit", 8, *options
    )
    assert status == 2 and message in err
