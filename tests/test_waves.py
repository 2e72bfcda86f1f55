"""Waves of one source: against partial waves, the point mass, the glory, and themselves."""

import cmath
import csv
import json
import math
import tracemalloc
from pathlib import Path

import mpmath
import numpy as np
import problems
import pytest
from command_line import run

import kerrcaustics as kc
from kerrcaustics.beams.ends import SKY
from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.images.sheets import sheets_of
from kerrcaustics.scripts import STUDIES
from kerrcaustics.waves.amplification import METHODS
from kerrcaustics.waves.nearest_curve import nearest_curve
from kerrcaustics.waves.uniform import fold_field, fold_parameters, pearcey, ring_pair
from kerrcaustics.waves.wave_images import wave_images
from kerrcaustics.waves.wave_sources import WaveSource

TWIN = STUDIES.module("truth.partial_waves")
MODES = STUDIES.module("truth.separated_modes")
CAMERA = kc.Camera(0.0, 10.0, math.pi / 2, "fiducial")
SPINNING = kc.Camera(0.9, 10.0, 1.3, "fiducial")
ROWS = json.loads((Path(__file__).parent / "data" / "waves_spin.json").read_text())["rows"]
VIEWERS = sorted({(row["spin"], row["radius"], row["inclination"]) for row in ROWS})
ANGLES = (1e-3, 0.05, 0.3, 1.0, 1.5, 1.8, 2.6, 3.0, 3.1, 3.14)
FEW = (1e-3, 0.3, 1.8, 3.1)


@pytest.mark.slow
@pytest.mark.parametrize("omega", [0.5, 1.0, 2.0, 5.0, 10.0])
def test_partial_waves_lie_within_the_error(omega):
    angles = FEW if omega == 1 else ANGLES
    expected = TWIN.field(omega, 10.0, np.array(angles))
    for angle, value in zip(angles, expected, strict=True):
        seen = kc.amplification(CAMERA, (math.pi / 2, math.pi - angle), omega, max_index=4)
        assert seen.certified and abs(seen.value[0] - value) < seen.error[0] < 0.12 / omega * max(abs(value), 1)


@pytest.mark.slow
@pytest.mark.parametrize("radius", [2.3, 4.5])
def test_errors_hold_next_to_the_hole(radius):
    """Rings are seen far from the axis there, and asymptotics are worse."""
    camera = kc.Camera(0.0, radius, math.pi / 2, "static")
    angles = (0.1, 0.6, 1.0, 1.3, 2.6)
    for omega in (0.25, 1.0):
        for angle, value in zip(angles, TWIN.field(omega, radius, np.array(angles)), strict=True):
            seen = kc.amplification(camera, (math.pi / 2, math.pi - angle), omega, max_index=4)
            assert abs(seen.value[0] - value) < seen.error[0]


@pytest.mark.slow
@pytest.mark.parametrize("radii", [(10.0, 20.0), (10.0, 200.0), (4.0, 30.0), (2.3, 4.0)])
def test_green_s_function_of_partial_waves(radii):
    """Of sources at a finite radius, beyond the camera and within its radius."""
    angles = np.array([1e-3, 0.3, 1.8])
    for omega in (0.5, 4.0):
        expected = TWIN.field_within(omega, radii, math.pi - angles)
        for seen_from, end in (radii, radii[::-1]):
            camera = kc.Camera(0.0, seen_from, math.pi / 2, "static")
            for angle, value in zip(angles, expected, strict=True):
                seen = kc.amplification(camera, (math.pi / 2, math.pi - angle), omega, max_index=4, end=end)
                assert seen.certified and abs(seen.value[0] - value) < seen.error[0] < 0.16 * max(abs(value), 1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("viewer", "radius"),
    [(kc.Camera(0.9, 20.0, 1.1, (0.1, 0.2, -0.3)), 6.0), (kc.Observer(spin=0.9, inclination=1.0), 10.0)],
)
def test_source_and_viewer_change_places(viewer, radius):
    """Images of a source within the viewer's radius, traced there: the amplitudes and times of the exchanged ones."""
    place = (1.4, 2.5)
    seen = kc.amplification(viewer, place, [0.5, 5.0], end=radius)
    rays = kc.star_images(viewer, place, seen.max_index, end=radius)
    b, q = (np.array(part) for part in constants_of(viewer, rays))
    square = radius**2 + 0.9**2
    root = np.sqrt((square - 0.9 * b) ** 2 - (square - 2 * radius) * (q + (b - 0.9) ** 2))
    # nu_viewer / E is g by u^t of a static source, less what the source's motion round the hole would add: none.
    clock = 1 / math.sqrt(1 - 2 * radius / (radius**2 + (0.9 * math.cos(1.4)) ** 2))
    apart = 1.0
    if math.isfinite(viewer.radius):
        ends = [
            r * np.array([math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)])
            for r, t, p in ((viewer.radius, viewer.inclination, 0.0), (radius, *place))
        ]
        apart = np.linalg.norm(ends[0] - ends[1])
    amplitude = rays.redshift * clock * apart * np.sqrt(rays.magnification / root)
    order = np.argsort(seen.image_time[seen.image_index <= seen.max_index])
    assert seen.image_amplitude[order] == pytest.approx(amplitude[np.argsort(rays.time)], rel=1e-9)
    assert seen.image_time[order] == pytest.approx(np.sort(rays.time), abs=1e-9)
    assert seen.images.index.tolist() == rays.index.tolist() and np.isfinite(seen.value).all()


def constants_of(viewer, rays):
    """b and q of the light of images within the viewer's radius."""
    found = []
    for sky, second in zip(rays.sky, rays.second_arrival, strict=True):
        end = kc.Sphere(rays.surface.radius, second_arrival=bool(second))
        at = kc.trace_beams(viewer, sky, end=end, constants=True)
        found.append((float(at.impact), float(at.carter)))
    return zip(*found, strict=True)


def point_mass(w, y):
    """Wave optics of a point mass far away (Deguchi & Watson 1986), with the phase of times to the hole."""
    phase = mpmath.mpf(w) / 2 * mpmath.log(mpmath.mpf(w) / 2)
    modulus = mpmath.exp(mpmath.pi * w / 4) * mpmath.gamma(1 - 0.5j * w)
    return complex(modulus * mpmath.hyp1f1(0.5j * w, 1, 0.5j * w * y * y) * mpmath.exp(1j * phase))


@pytest.mark.slow
@pytest.mark.parametrize(("w", "most"), [(10.0, 0.03), (1.0, 0.12), (4.0, 0.08), (25.0, 0.012)])
def test_point_mass_far_away(w, most):
    viewer = kc.Observer(spin=0.0, inclination=math.pi / 2, radius=1e8)
    size = math.sqrt(4 / viewer.radius)
    found = []
    for y in (1e-3, 0.5, 1.0, 2.0):
        seen = kc.amplification(viewer, (math.pi / 2, math.pi - y * size), w / 4, max_index=1)
        # Times are counted from the plane wave through the hole.
        found.append((seen.value[0], seen.error[0], point_mass(w, y) * cmath.exp(-0.5j * w * y * y)))
    # One constant of time is that of the point mass' own.
    turn = cmath.exp(1j * w / 4 * 11.4247)
    for value, error, exact in found:
        assert abs(value - exact * turn) < error
    assert abs(found[0][0]) ** 2 == pytest.approx({1.0: 3.2835, 10.0: 31.41593}.get(w, math.pi * w), rel=0.05)
    assert found[0][1] <= most * abs(found[0][2]) and found[1][1] <= max(most, 0.03) * 1.1 * abs(found[1][2])


@pytest.mark.slow
@pytest.mark.parametrize("viewer", VIEWERS)
def test_waves_of_spinning_holes_by_separated_modes(viewer):
    """Random places, behind the hole, on folds and cusps: each method lies within its error."""
    rows = [row for row in ROWS if (row["spin"], row["radius"], row["inclination"]) == viewer]
    camera = kc.Camera(*viewer, "fiducial")
    for row in rows:
        for method in METHODS:
            seen = kc.amplification(camera, row["source"], row["omega"], max_index=2, end=row["end"], method=method)
            off = abs(seen.value[0] - complex(*row["field"]))
            assert off <= seen.error[0] + row["tail"], (row, method)


# Sources beside primary caustics much smaller than the wave resolves, and the fields there by separated modes.
TINY_CAUSTICS = (
    (kc.Camera(0.998, 144.545560302, math.pi / 2, "fiducial"), (1.567960308, 2.960790419), 0.3072176415, 7.227278015),
    (kc.Camera(0.998, 4.776862827, math.pi / 2, "fiducial"), (1.570410800, 2.835194185), 0.9289214695, 86.12138226),
)
FIELDS_BESIDE_THEM = 1.94232314 - 1.08127217j, 3.14455079 + 2.23842807j


@pytest.mark.slow
@pytest.mark.parametrize("case", range(len(TINY_CAUSTICS)))
def test_a_fold_or_cusp_of_an_unresolved_caustic_is_in_doubt(case):
    camera, place, omega, end = TINY_CAUSTICS[case]
    for method in ("fold", "cusp"):
        seen = kc.amplification(camera, place, omega, end=end, method=method)
        assert abs(seen.value[0] - FIELDS_BESIDE_THEM[case]) < seen.error[0]
    best = kc.amplification(camera, place, omega, end=end)
    assert abs(best.value[0] - FIELDS_BESIDE_THEM[case]) < best.error[0] < 0.5 * abs(best.value[0])


@pytest.mark.slow
@pytest.mark.parametrize("viewer", [VIEWERS[i] for i in (0, 1, 8, 9, 10)])
def test_separated_modes_give_the_fields_of_the_table(viewer):
    rows = [row for row in ROWS if (row["spin"], row["radius"], row["inclination"]) == viewer]
    (spin, radius, inclination), (end, omega) = viewer, (rows[0]["end"], rows[0]["omega"])
    places = np.array([row["source"] for row in rows])
    values, rest = MODES.field(spin, omega, (radius, inclination), end, places)
    assert values == pytest.approx([complex(*row["field"]) for row in rows], abs=1e-8)
    assert (rest < 1e-10).all()


@pytest.mark.slow
def test_separated_modes_are_partial_waves_without_spin():
    angles = np.array([0.3, 1.8, 3.1])
    # Seen from the axis, angles from the viewer are those of places.
    places = np.stack([angles, 0 * angles], axis=-1)
    for radii in ((4.0, 30.0), (2.3, 4.0)):
        values, _ = MODES.field(0.0, 0.5, (radii[0], 0.0), radii[1], places)
        assert values == pytest.approx(TWIN.field_within(0.5, radii, angles), abs=1e-7)


# Modulus of the field at points of the table, by separated modes.
ON_CAUSTICS = {"cusp": 0.85590569, "fold": 0.845}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ON_CAUSTICS)
def test_fields_on_caustics_are_finite_and_right(kind):
    """On a caustic and beside it; the sum of images is not, and its error says so."""
    camera, place, end = (getattr(problems.POINTS[kind], name) for name in ("viewer", "place", "end"))
    modulus = ON_CAUSTICS[kind]
    for d in (0.0, 1e-10, 1e-6):
        source = place[0] + d, place[1] + 0.3 * d
        seen, summed = (
            kc.amplification(camera, source, 1.0, max_index=2, end=end, method=method) for method in ("auto", "images")
        )
        assert abs(abs(seen.value[0]) - modulus) < seen.error[0] and seen.certified
        assert abs(summed.value[0]) < summed.error[0] + abs(seen.value[0]) + seen.error[0]
        if kind == "cusp":
            # The field is of use there; at the fold, next to the hole, images of high index make up much of the error.
            assert seen.error[0] < 1.2


@pytest.mark.slow
def test_cusps_that_were_found_are_places_for_sources():
    """Of a small astroid on the celestial sphere, where the ring integral holds, and the sum of images does not."""
    camera = kc.Camera(0.99, 24.958231056054704, 1.2308228282942322)
    cusp = kc.caustics(camera, 1)[0].cusps[0].celestial
    seen = kc.amplification(camera, cusp, 1.0)
    # A point mass of the same ring: the root of 4 pi omega, within the parts that other images add.
    assert abs(abs(seen.value[0]) - math.sqrt(4 * math.pi)) < 0.3 and seen.error[0] < 0.3
    summed = kc.amplification(camera, cusp, 1.0, method="images")
    assert abs(summed.value[0] - seen.value[0]) < summed.error[0] + seen.error[0] and not summed.certified


def schwarzschild_time(radius, angle):
    """Time of light from a star at infinity to a viewer, at an angle from it, in long arithmetic; less r + 2 ln r."""
    with mpmath.workdps(50):
        start = 1 / mpmath.mpf(radius)

        def parts(b):
            turn = mpmath.findroot(lambda u: 1 / b**2 - u**2 + 2 * u**3, 1 / b)

            def along(u, power):
                """Twice w times the rates of angle and time by u = turn - w^2."""
                rest = turn + u - 2 * (turn**2 + turn * u + u**2)
                rate = 2 / mpmath.sqrt(rest)
                return rate if power == 0 else rate / (b * u**2 * (1 - 2 * u))

            return turn, along

        def swept(b):
            turn, along = parts(b)
            wide, short = mpmath.sqrt(turn), mpmath.sqrt(turn - start)
            return sum(mpmath.quad(lambda w: along(turn - w**2, 0), [0, end]) for end in (wide, short))

        b = mpmath.findroot(lambda b: swept(b) - angle, radius * mpmath.sin(angle))
        turn, along = parts(b)
        near, middle = mpmath.sqrt(turn - start), mpmath.sqrt(turn / 2)
        inner = [mpmath.quad(lambda w: along(turn - w**2, 1), [0, end]) for end in (near, middle)]

        def regular(u):
            return along(u, 1) / (2 * mpmath.sqrt(turn - u)) - 1 / u**2 - 2 / u

        outer = mpmath.quad(regular, [turn / 2**60, turn / 2**30, turn / 16, turn / 2])
        return float(sum(inner) + outer - 2 / turn + 2 * mpmath.log(turn / 2))


@pytest.mark.slow
@pytest.mark.parametrize("radius", [1e4, 1e8])
def test_phases_of_far_viewers_lie_within_the_error(radius):
    """The time of the direct image is rounded to parts of the radius: its error belongs to the phase, and is small."""
    seen = kc.amplification(kc.Camera(0.0, radius, 1.2, "fiducial"), (1.2, 2.9), [1.0, 1e4, 1e5], max_index=0)
    direct = int(np.flatnonzero(seen.image_index == 0)[0])
    cosine = mpmath.sin(mpmath.mpf(1.2)) ** 2 * mpmath.cos(mpmath.mpf(2.9)) + mpmath.cos(mpmath.mpf(1.2)) ** 2
    late = abs(seen.image_time[direct] - schwarzschild_time(radius, mpmath.acos(cosine)))
    turned = np.abs(np.exp(1j * seen.frequency * late) - 1) * seen.image_amplitude[direct]
    assert (turned < seen.error).all() and late < 1e-15 * radius + 1e-11
    assert seen.error[1] < 0.05


def test_high_frequencies_take_no_more_memory_and_say_what_is_not_known():
    """Green light at ten suns and radio waves at a billion: the limit of rays, whose phases are known or not."""
    source, omega = (1.4, 2.9), np.array([1e4, 1e6, 1e8, 2e11, 5e16, 1e30, 1e100])
    kc.amplification(CAMERA, source, 1.0, max_index=1)
    tracemalloc.start()
    seen = kc.amplification(CAMERA, source, omega, max_index=1)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 50e6 and seen.certified
    # The image of index 2 belongs to a ring with that of index 1.
    amplitude, turn = seen.image_amplitude, np.exp(-0.5j * math.pi * seen.image_index)
    direct = (amplitude * turn * np.exp(1j * omega[:, None] * seen.image_time)).sum(axis=1)
    known = omega < 1e11
    assert (np.abs(seen.value - direct)[known] < seen.error[known]).all() and (seen.error[known] < 0.05).all()
    assert (seen.error[omega > 1e15] > amplitude.sum()).all() and (np.abs(seen.value) <= 1.01 * amplitude.sum()).all()
    assert any(remark.startswith("travel times of images are known to") for remark in seen.remarks)


def test_fields_go_on_through_folds():
    """What the images of a bright place say of the field holds on the dark side, where there are none."""
    model = np.array([2.0, 1.3, 0.8, 0.1])
    size = model[1] ** 0.25
    amplitude = np.array([model[2] / size + model[3] * size, model[2] / size - model[3] * size]) / 2
    time = model[0] + np.array([-1, 1]) * model[1] ** 1.5 * 2 / 3
    assert fold_parameters(time, amplitude) == pytest.approx(model, rel=1e-14)
    dark, _ = fold_field(np.array([5.0]), 1, np.array([2.0, -1.3, 0.8, 0.1]))
    z = 5 ** (2 / 3) * 1.3
    airy = 0.8 * 5 ** (1 / 6) * mpmath.airyai(z) - 0.1j * 5 ** (-1 / 6) * mpmath.airyai(z, derivative=1)
    assert abs(dark[0] - complex(airy) * math.sqrt(math.pi) * cmath.exp(1j * (10 - 0.75 * math.pi))) < 1e-14


@pytest.mark.slow
def test_glory_of_a_hole_without_spin():
    """Matzner et al. 1985: 2 pi omega b^2 |db / dTheta| J0^2, for small angles."""
    viewer, b, slope = kc.Observer(spin=0.0, inclination=math.pi / 2), 5.3569586307887886, 0.17055373458
    for omega, angle in ((5.0, 1e-3), (10.0, 1e-3), (10.0, 5e-3)):
        seen = kc.amplification(viewer, (math.pi / 2, angle), omega)
        expected = 2 * math.pi * omega * b**2 * slope * float(mpmath.besselj(0, b * omega * math.sin(angle))) ** 2
        assert abs(seen.value[0]) ** 2 == pytest.approx(expected, rel=2e-3)
        assert min(seen.image_index) == 1


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, 2])
def test_stationary_places_are_the_images(order):
    """The sum of a ring is that of its images where these are far apart in phase."""
    star = (1.5, 2.5) if order == 1 else (1.2, 4.9)
    curve = nearest_curve(WaveSource(SPINNING, SKY, star), sheets_of(SPINNING, 2).curves, order)
    assert curve.is_smooth and curve.nodes(10.0) > 1.2 * 10 * curve.fastest
    waves = kc.amplification(SPINNING, star, 1.0, method="images", max_index=2)
    here = (waves.image_index == order - 1) | (waves.image_index == order)
    times, index, amplitude = waves.image_time[here], waves.image_index[here], waves.image_amplitude[here]
    misses = []
    for omega in (50.0, 200.0):
        direct = (amplitude * np.exp(1j * (omega * times - math.pi / 2 * index))).sum()
        misses.append(abs(curve.field(np.array([omega]))[0] - direct) / abs(amplitude).sum())
    assert misses[0] < 1e-2 and misses[1] < misses[0] / 2


def test_pairs_far_apart_are_their_images():
    omega, time, amplitude = np.array([200.0]), np.array([3.0, 5.0]), np.array([0.7, 0.4])
    fold, size = fold_field(omega, 1, fold_parameters(time, amplitude))
    assert size[0] == pytest.approx((0.7 + 0.4) / math.sqrt(2))
    for value in (fold[0], ring_pair(omega, 1, time, amplitude)[0]):
        sum_of_both = sum(s * cmath.exp(1j * (200 * t - math.pi / 2 * n)) for s, t, n in ((0.7, 3.0, 1), (0.4, 5.0, 2)))
        assert abs(value - sum_of_both) < 2e-3


def test_sums_by_kernels_are_those_of_arrays():
    """Phases of up to a million radians, beyond whole turns and negative, at frequencies in no order."""
    random = np.random.default_rng(3)
    omega, count = 10 ** random.uniform(-2, 4, 37), 5000
    phase, *amplitudes = random.uniform(-100, 100, count), *random.uniform(-1, 1, (2, count))
    parts = kernel("phase_sums").on_rays((count,), [omega], tables=[np.stack([phase, *amplitudes], axis=1)])
    turns = np.exp(1j * omega[:, None] * phase)
    for one, other, amplitude in zip(parts[::2], parts[1::2], amplitudes, strict=True):
        np.testing.assert_allclose(one + 1j * other, turns @ amplitude, atol=1e-13 * count * max(1, omega.max() / 100))


def test_pearcey_s_integrals_are_those_of_long_arithmetic():
    assert abs(pearcey(np.zeros(1), np.zeros(1))[0, 0] - math.gamma(0.25) / 2 * cmath.exp(1j * math.pi / 8)) < 1e-12
    turn = mpmath.exp(0.125j * mpmath.pi)
    for x, y in ((-6.0, 3.0), (3.0, 2.0), (5.0, -8.0)):
        for power, value in enumerate(pearcey(np.array([x]), np.array([y]))[0]):

            def part(s, power=power, x=x, y=y):
                t = s * turn
                return t**power * mpmath.exp(1j * (t**4 + x * t**2 + y * t)) * turn

            assert abs(value - complex(mpmath.quad(part, list(range(-6, 7))))) < 1e-11
    # Where round-off would spoil them there are none.
    assert np.isnan(pearcey(np.array([-20.0]), np.array([0.0]))).all()


@pytest.mark.slow
def test_a_star_within_a_cusp_is_what_the_integral_says():
    """At the cusps of a secondary caustic, where both methods hold; and where only one does."""
    camera = kc.Camera(0.3, 10.0, 1.0, "fiducial")
    cusps = np.array([cusp.celestial for cusp in kc.caustics(camera, 2)[1].cusps])
    star = cusps[0] + 0.2 * (cusps.mean(axis=0) - cusps[0])
    one, other = (
        kc.amplification(camera, star, [200.0, 1000.0, 5000.0], max_index=2, method=how) for how in ("cusp", "line")
    )
    off, error = np.abs(one.value - other.value), one.error + other.error
    assert (off <= error).all()
    assert (off[1:] < 0.02).all() and (one.error[1:] < 0.04).all()
    # A cusp more than a right angle from parts of its caustic: the integral has a gap.
    camera = kc.Camera(0.95, 5.0, 1.3, "fiducial")
    seen, other = (kc.amplification(camera, (1.3, 5.3721), [50.0, 100.0], method=how) for how in ("auto", "cusp"))
    assert seen.method.tolist() == ["line", "line"] and (seen.error < 0.2 * np.abs(seen.value)).all()
    assert (np.abs(seen.value - other.value) <= seen.error + other.error).all()


def test_ring_integral_leaves_out_where_a_long_caustic_makes_it_jump():
    """Beside the near end of the secondary caustic of a = 0.999, r = 6.03, which is 250 degrees long."""
    camera, omega = kc.Camera(0.999, 6.03), np.array([30.0, 100.0, 1000.0])
    source = WaveSource(camera, SKY, (1.2, 5.3))
    curve = nearest_curve(source, source.sheets(2).curves, 2)
    ring = wave_images(source, kc.star_images(camera, source.place, 2)).ring(2)
    held = curve.holds(ring.time)
    assert curve.is_smooth and curve.gap is not None and 0 < held.sum() < len(held)
    field, lost = curve.field_and_loss(omega)
    assert (np.diff(lost) < 0).all() and lost[2] < 1e-9
    off = np.abs(field - ring[held].field(omega))
    assert (off < lost + 0.1 / omega * ring.amplitude[held].sum()).all()


@pytest.mark.slow
def test_images_beside_a_cusp_or_another_caustic_are_counted_with_their_error():
    """A lone image next to a cusp is not alone; one of an index of the ring, but beside the next caustic, is summed."""
    beside_cusp = kc.Camera(0.9395650251175529, 21.94846597224929, 2.3892779551396615, "fiducial")
    beside_next = kc.Camera(0.9913233473983306, 19.183388460682, 1.5481188836551036, "fiducial")
    for camera, star in ((beside_cusp, (2.651755846824377, 5.419824921304284)), (beside_next, (1.592904, 3.083013))):
        one, other = (kc.amplification(camera, star, [100.0, 1000.0], method=how) for how in ("line", "images"))
        assert (np.abs(one.value - other.value) <= one.error + other.error).all()
    source = WaveSource(beside_next, SKY, (1.592904, 3.083013))
    waves = wave_images(source, kc.star_images(beside_next, source.place, 2))
    held = nearest_curve(source, source.sheets(1).curves, 1).holds(waves.ring(1).time)
    assert waves.ring(1).time[~held] == pytest.approx([44.2656], abs=1e-3)


@pytest.mark.slow
def test_velocity_does_not_matter_and_negative_frequencies_are_conjugate():
    star, omega = (1.4, 2.9), [0.7, 3.0, 30.0]
    still = kc.amplification(SPINNING, star, omega)
    moving = kc.amplification(kc.Camera(0.9, 10.0, 1.3, (0.1, -0.3, 0.4)), star, omega)
    assert np.abs(moving.value - still.value).max() < 1e-6
    assert np.allclose(kc.amplification(SPINNING, star, [-x for x in omega]).value, still.value.conj(), rtol=0, atol=0)


@pytest.mark.slow
def test_methods_agree_where_both_hold():
    chance = np.random.default_rng(7)
    for _ in range(40):
        camera = kc.Camera(
            float(chance.uniform(0.01, 0.99)),
            3 * 30 ** float(chance.uniform()),
            math.acos(chance.uniform(-0.95, 0.95)),
            "fiducial",
        )
        star = math.acos(chance.uniform(-1, 1)), float(chance.uniform(0, 2 * math.pi))
        omega = np.sort(10 ** chance.uniform(-0.3, 2, 5))
        best = kc.amplification(camera, star, omega)
        for method in ("line", "images"):
            other = kc.amplification(camera, star, omega, method=method)
            assert (np.abs(other.value - best.value) <= other.error + best.error).all()


@pytest.mark.slow
def test_star_on_an_axis_is_finite():
    """All images of a ring are one there, as bright as the root of pi w for a point mass."""
    value = TWIN.field(2.0, 10.0, np.zeros(1))[0]
    seen = kc.amplification(CAMERA, (math.pi / 2, math.pi), 2.0, max_index=4)
    assert abs(seen.value[0] - value) < seen.error[0] < 0.1 * abs(value) and seen.method[0] == "line"


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, 2])
def test_star_goes_through_a_caustic_without_a_jump(order):
    """Also where `auto` changes its method."""
    camera = kc.Camera(0.5, 16.0, 1.2, "fiducial")
    curve = kc.caustics(camera, order)[order - 1]
    middle = curve.place[np.argmin(curve.place[:, 0])]
    stars = [(float(middle[0] + d), float(middle[1])) for d in np.linspace(-0.2, 0.2, 61)]
    seen = [kc.amplification(camera, star, 3.0) for star in stars]
    values, errors = (np.array([getattr(one, name)[0] for one in seen]) for name in ("value", "error"))
    assert np.isfinite(values).all() and np.isfinite(errors).all()
    bend = np.abs(values[2:] - 2 * values[1:-1] + values[:-2])
    assert (bend < 2 * (errors[2:] + errors[1:-1]) + 0.1 * np.abs(values[1:-1])).all()


def test_command_says_what_the_function_returns(capsys, tmp_path):
    line = "amplification --spin 0.9 --radius 10 --star 80 166 --frequency 0.5:50:7 --max-index 1"
    status, out, _ = run(capsys, *line.split(), "--json", "-", "--figure", str(tmp_path / "waves.png"))
    printed = json.loads(out)
    seen = kc.amplification(kc.Camera(0.9, 10.0), (math.radians(80), math.radians(166)), [0.5, 50.0], max_index=1)
    rows = printed["waves"]
    assert status == 0 and len(rows) == 7 and rows[0]["frequency"] == 0.5
    assert complex(rows[0]["real"], rows[0]["imaginary"]) == pytest.approx(seen.value[0], rel=1e-9)
    assert [row["method"] for row in (rows[0], rows[-1])] == seen.method.tolist()
    assert (tmp_path / "waves.png").stat().st_size > 10_000
    file = tmp_path / "waves.npz"
    kc.save(file, seen)
    assert kc.load(file) == seen and "certified" not in repr(seen)


def test_tables_hold_the_field_and_the_images(capsys, tmp_path):
    fits = pytest.importorskip("astropy.io.fits")
    seen = kc.amplification(CAMERA, (1.4, 2.9), [1.0, 10.0], max_index=1)
    seen.to_csv(tmp_path / "waves.csv")
    seen.to_fits(tmp_path / "waves.fits")
    rows = list(csv.DictReader((tmp_path / "waves.csv").open()))
    assert [float(row["imaginary"]) for row in rows] == seen.imaginary.tolist()
    with fits.open(tmp_path / "waves.fits") as units:
        assert [unit.name for unit in units[1:]] == ["WAVES", "IMAGES"] and units["WAVES"].header["CERTIF"]
        assert units["WAVES"].data["method"].tolist() == seen.method.tolist()
        np.testing.assert_array_equal(units["IMAGES"].data["image_amplitude"], seen.image_amplitude)
    file = tmp_path / "table.csv"
    options = ["--spin", 0, "--radius", 10, "--velocity", "fiducial", "--star", 80, 166]
    status, out, _ = run(capsys, "amplification", *options, "--frequency", "1:10:3", "--max-index", 1, "--table", file)
    assert status == 0 and str(file) in out and len(file.read_text().splitlines()) == 4


@pytest.mark.slow
def test_patterns_are_those_of_single_stars():
    camera = kc.Camera(0.5, 16.0, 1.2, "fiducial")
    pattern = kc.diffraction_pattern(camera, ((1.15, 1.25), (5.7, 5.8)), 20.0, pixels=5)
    assert pattern.orders == (2,) and pattern.value.shape == (5, 5)
    for i, j in ((0, 0), (1, 3), (2, 2)):
        one = kc.amplification(camera, (pattern.theta[i], pattern.phi[j]), 20.0, method="line")
        assert abs(pattern.value[i, j] - one.value[0]) < min(1e-4, pattern.error[i, j] + one.error[0])
    assert len(pattern.plot().collections) == 1
    with pytest.raises(ValueError, match=r"^Argument `region` must lie where"):
        kc.diffraction_pattern(kc.Camera(0.99, 6.0, 1.3, "fiducial"), ((1.2, 1.4), (1.0, 1.2)), 5.0, pixels=2)
    for region in (((1.2, 1.1), (0.0, 1.0)), (1.0, 2.0), ((0.0, 1.0), (0.0, 1.0))):
        with pytest.raises(ValueError, match=r"^Argument `region` must be"):
            kc.diffraction_pattern(camera, region, 5.0)


@pytest.mark.slow
def test_pattern_of_a_long_caustic_is_that_of_single_stars():
    camera = kc.Camera(0.999, 6.03)
    pattern = kc.diffraction_pattern(camera, ((1.3, 1.84), (5.15, 5.6)), 40.0, max_index=1, pixels=9)
    assert pattern.orders == (2,) and "come and go" in pattern.remarks[0]
    for i, j in ((0, 8), (2, 1), (4, 4), (7, 5)):
        one = kc.amplification(camera, (pattern.theta[i], pattern.phi[j]), 40.0, max_index=1, method="line")
        # Images beside the next caustic make up the difference.
        assert abs(pattern.value[i, j] - one.value[0]) < min(0.15, pattern.error[i, j] + one.error[0])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"frequencies": 0.0}, "Argument `frequencies` must be finite, and 0.05 to 1e+100 in modulus"),
        ({"frequencies": 1e101}, "Argument `frequencies` must be finite, and 0.05 to 1e+100 in modulus"),
        ({"frequencies": [1.0, math.nan]}, "Argument `frequencies` must be finite"),
        ({"frequencies": []}, "Argument `frequencies` must be a number or a list"),
        ({"frequencies": "low"}, "Argument `frequencies` must be finite"),
        ({"max_index": 7}, "Argument `max_index`"),
        ({"end": kc.EquatorialPlane(1)}, "Argument `end` must be math.inf or the radius of the source"),
        ({"end": 1.0}, "Argument `end` must be larger than the horizon radius"),
        ({"method": "waves"}, "Argument `method` must be one of auto, images, fold, cusp, ring, line"),
        ({"source": (1.0, 2.0, 3.0)}, "Argument `source`"),
    ],
)
def test_bad_arguments_are_one_line(changes, words):
    arguments = {"source": (1.4, 2.9), "frequencies": 1.0, **changes}
    with pytest.raises(ValueError) as caught:
        kc.amplification(SPINNING, **arguments)
    assert str(caught.value).startswith(words) and "\n" not in str(caught.value)
