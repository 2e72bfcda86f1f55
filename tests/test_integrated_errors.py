"""The integrator alone at its limits: far and fast cameras, grazed spheres, nearly extremal holes.

True numbers are those of a program in quadruple precision that shares no code with this one.
"""

import math
from typing import NamedTuple

import numpy as np
import pytest

import kerrcaustics as kc


class Known(NamedTuple):
    """A camera, a direction of its sky and its end; the true direction, azimuth, index and major diameter there."""

    camera: kc.Camera
    sky: tuple[float, float, float]
    end: float
    direction: tuple[float, float, float]
    azimuth: float
    index: int
    diameter: float | None


KNOWN = {
    "far and fast, next to the axis": Known(
        kc.Camera(
            0.999,
            6444.011885413617,
            3.141587062714775,
            (-0.5290398869046986, 0.26111326906975657, -0.15270044003959146),
        ),
        (0.1440140343564214, 0.9662109186047846, 0.21376720673968239),
        math.inf,
        (-0.04303164284598552, 0.018031864418212796, -0.9989109717985776),
        9.027968575049929,
        4,
        9707001.864169922,
    ),
    "very far": Known(
        kc.Camera(
            1.1707394893816748e-07,
            517843.5506284635,
            1.570796326796585,
            (0.014159933842477998, 0.22354115010337608, 0.09000788047338493),
        ),
        (-0.9724045609135455, 0.18537189846515734, -0.14165673006941257),
        math.inf,
        (0.6355217008509286, -0.6178897324562665, 0.4629518833233818),
        11.795038706483577,
        3,
        774130631.937011,
    ),
    "camera on the axis, own radius": Known(
        kc.Camera(
            0.9807371998012386, 19.43021723846922, 0.0, (-0.8337754639669269, 0.08472186055683749, 0.05515116862366895)
        ),
        (-1.4999459422775232e-08, 0.8074135133612224, 0.5899859476645923),
        19.43021723846922,
        (-2.4002423382760138e-08, -5.882922194341021e-16, 0.9999999999999997),
        -3.141592629080092,
        0,
        None,
    ),
    "own radius": Known(
        kc.Camera(0.0007564201792408868, 3.3211843451440917, 1.5953107423486124, (0.0, 0.0, -0.11274559304695746)),
        (-6.709698868599193e-09, -0.11274560653101462, 0.9936238866935283),
        3.3211843451440917,
        (0.9996995389216408, -1.91493139897816e-11, -0.024511872222636653),
        -1.9155069342572316e-11,
        0,
        None,
    ),
    "far, on the equator": Known(
        kc.Camera(
            1e-09, 3695119.969847574, 1.5707963267948966, (0.5973184058084521, -0.4750793988856606, 0.27765467005012795)
        ),
        (-0.610781041610165, 0.19029266940314316, 0.768593012706353),
        math.inf,
        (-0.9998722844594008, 0.004458237975066678, 0.015347276113262963),
        -3.1460514314757515,
        1,
        164.9314723389257,
    ),
    "very far, on the equator": Known(
        kc.Camera(
            0.9993548317837249,
            45965945.751620546,
            1.5707963267948966,
            (0.22535276622388303, 0.05041532473929191, 0.02272285000876118),
        ),
        (-0.12600484406821466, -0.9541487083529024, -0.2715198365126073),
        math.inf,
        (-0.9999992312730192, -0.0004666367358268159, 0.0011487834989891723),
        3.1420592906504665,
        1,
        16.420487609297652,
    ),
    "nearly extremal": Known(
        kc.Camera(0.9999999996363345, 4.4272543931041355, 1.5707963267948934, (0.0, -0.0, -0.0)),
        (-0.9302460494432847, -0.3402012279763066, -0.1374969526155946),
        math.inf,
        (0.5837944084917341, 0.8074218555861066, 0.08517062718845485),
        -475353.4396374569,
        14,
        865535680110491.9,
    ),
}
# Escaping rays that double precision cannot follow: next to the horizon they turn a hundred thousand radians.
BEYOND = {
    "a = 1 - 4e-8": (
        kc.Camera(0.9999999603753942, 1.0002911480688756, 1.5707963267949294, (0.0, 0.0, 0.0)),
        [0.9536214769221354, -0.15263245400170256, 0.2594405765069596],
    ),
    "a = 1 - 1e-11": (
        kc.Camera(0.9999999999889937, 1.0000251512490113, 1.5707963267948966, (0.0, 0.005894166845904536, 0.0)),
        [0.13196609137722312, -0.8565151481131444, -0.4989656819655404],
    ),
    "a = 1 - 5e-11": (
        kc.Camera(0.9999999999488379, 1.0000238720852868, 1.3729208473771262, (-0.0, 0.0, 0.0)),
        [0.947801959616335, -0.1673001503514812, -0.271444478742536],
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-10, 1e-14])
@pytest.mark.parametrize("known", KNOWN.values(), ids=KNOWN)
def test_errors_hold_at_the_limits(known, tolerance):
    """Within twice what is reported, of beams and of rays traced alone."""
    for trace in (kc.trace_rays, kc.trace_beams) if known.end == math.inf else (kc.trace_beams,):
        ends = trace(known.camera, [known.sky], "integrated", tolerance, end=known.end)
        assert ends.escaped.all()
        assert np.linalg.norm(ends.direction[0] - known.direction) <= 2 * ends.error[0]
        assert np.abs(ends.azimuth[0] - known.azimuth) <= 2 * ends.azimuth_error[0]
        assert ends.status[0] == (kc.Status.INACCURATE if ends.error[0] > tolerance else kc.Status.ESCAPED)
    assert not ends.index_certain[0] or ends.index[0] == known.index
    if known.diameter is not None:
        assert abs(ends.delta_plus[0] / known.diameter - 1) <= 2 * ends.diameter_error[0]


@pytest.mark.parametrize(("camera", "sky"), BEYOND.values(), ids=BEYOND)
def test_rays_beyond_double_precision_hold_numbers_and_say_so(camera, sky):
    beams = kc.trace_beams(camera, [sky], "integrated")
    assert beams.escaped.all()
    for values in (beams.direction, beams.azimuth, beams.error, beams.jacobian, beams.redshift):
        assert np.isfinite(values).all()
    assert beams.status[0] == kc.Status.INACCURATE
    assert beams.error[0] > 0.1
    assert beams.diameter_error[0] > 0.1
    assert not beams.index_certain[0]


@pytest.mark.slow
def test_rays_that_linger_next_to_the_photon_orbit_arrive_at_their_sphere():
    """Rounding of the potential moves the computed arrival by a tenth of the way or more: steps go on."""
    camera = kc.Camera(3.3914012618444754e-08, 3.000000009631506, 0.6482925803634595, (0.0, 0.0, -0.16898835782467717))
    sky = [
        [2.050339571677723e-14, -0.9039963241113659, -0.42754022733906377],
        [2.8253443414630413e-10, 0.20475633084763362, 0.978812977528299],
    ]
    directions = [
        [-0.4398982835437112, -0.285243078096999, -0.8515432382052281],
        [0.8907158745575668, -0.17713214931567497, 0.4186280359578874],
    ]
    for tolerance in (1e-4, 1e-14):
        beams = kc.trace_beams(camera, sky, "integrated", tolerance, end=3.0726985317940843, time=True)
        assert (np.linalg.norm(beams.direction - directions, axis=-1) <= 2 * beams.error).all()
        assert (np.abs(beams.azimuth - [-15.132692795451181, 18.6532520137918]) <= 2 * beams.azimuth_error).all()
        assert (np.abs(beams.time - [79.88445362755743, 95.28660213285478]) <= 2 * beams.time_error).all()
        assert (np.abs(beams.delta_plus / [66841056.73965583, 1060684257.105655] - 1) <= 2 * beams.diameter_error).all()
        assert (beams.error < 1e-3).all()
        assert (beams.crossings == [5, 6]).all()
        assert (~beams.index_certain | (beams.index == [4, 5])).all()


@pytest.mark.slow
@pytest.mark.parametrize("trace", [kc.trace_rays, kc.trace_beams])
def test_the_clock_of_long_steps(trace):
    """At a coarse tolerance, the times of rays and beams against those in many steps."""
    camera = kc.Camera(0.9, 6.0)
    turns = np.linspace(0.1, 6.2, 40)
    sky = np.stack([-0.9 * np.ones(40), np.sqrt(0.19) * np.cos(turns), np.sqrt(0.19) * np.sin(turns)], axis=-1)
    sky = np.concatenate([sky, sky * (-1, 1, 1), sky[:, ::-1]])
    sky /= np.linalg.norm(sky, axis=-1, keepdims=True)
    coarse, fine = (trace(camera, sky, "integrated", t, time=True) for t in (1e-4, 1e-12))
    there = coarse.escaped & fine.escaped
    assert there.sum() > 60
    late = np.abs(coarse.time - fine.time)[there] / (coarse.time_error + fine.time_error)[there]
    assert late.max() <= 1


def test_crossings_of_a_ray_that_hardly_leaves_the_plane():
    """It ends 1e-26 rad off the plane, which it crossed: rounding alone makes that zero."""
    hidden = kc.Camera(0.9999999987817713, 1.0359150839286237, velocity=(0.0, 3.6684766105278415e-09, 0.0))
    assert not kc.trace_beams(hidden, [[-0.0, 3.6684766105278415e-09, -1.0]], "integrated").crossings_certain[0]
    within = kc.trace_beams(kc.Camera(0.9, 6.0), [[0.6, 0.8, 0.0]], "integrated")
    assert within.crossings_certain[0]
    assert within.crossings[0] == 0


# (camera, N, end, delta_plus, delta_minus, time), by the truth of studies/adversary.
LOOSE = {
    "down to the horizon": (
        kc.Camera(5.3190421670636715e-08, 5.705768055057724, 1.5707963267960996, (0.0, 0.0, 0.0)),
        [-0.9842172351567642, 0.15675429806332816, 0.08212505134883054],
        2.0000311889899836,
        (2.421627585145478, -2.2842579761290764, 27.340044288697122),
    ),
    "hardly beyond the camera's radius": (
        kc.Camera(0.9975969916896275, 6416.8809478483145, 1.570796327522174, (0.0, 0.0, 0.9999999892932566)),
        [3.263215651084535e-10, 0.9999999989966526, 4.479614713505959e-05],
        6416.880947901481,
        (3653.186588764757, 0.021048471932209104, 0.010810077678604826),
    ),
    "a hair over the plane": (
        kc.Camera(0.9999999983395637, 4.3514400850863275, math.pi / 2, (-0.9996145409326048, 0.0, 0.0)),
        [0.02875687165037595, 0.9995864356487056, -3.795924448288482e-14],
        kc.EquatorialPlane(1),
        (22796.23240008162, -8.257350653264507e-12, 40.566522958694165),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-4, 1e-14])
@pytest.mark.parametrize("name", LOOSE)
def test_beams_to_finite_ends(name, tolerance):
    camera, sky, end, (major, minor, time) = LOOSE[name]
    beam = kc.trace_beams(camera, [sky], "integrated", tolerance, end=end, time=True)
    allowed = 2 * beam.diameter_error[0] * major
    assert abs(beam.delta_plus[0] - major) < allowed and abs(beam.delta_minus[0] - minor) < allowed
    assert abs(beam.time[0] - time) < 2 * beam.time_error[0] and beam.escaped[0]
    assert beam.index_certain[0] == (name == "down to the horizon")
