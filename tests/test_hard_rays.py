"""Rays that double precision barely knows, in closed form: what is said of them is true, and no less accurate than N.

Truth: 50 digits, by Taylor series of the equations of motion (as studies/truth), for N exactly as printed.
"""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.sphere import angle_between, polar_basis

# Long way to a finite sphere; and to the camera's own radius, starting nearly at right angles, or nearly toward it.
LONG_WAY = (kc.Camera(0.3, 3.0, 1.0, "fiducial"), [-0.19306087562622654, -0.9783793999114755, 0.07417039929308701])
TANGENTIAL = (
    kc.Camera(
        0.9807371998012386, 19.43021723846922, 0.0, (-0.8337754639669269, 0.08472186055683749, 0.05515116862366895)
    ),
    [-1.4999459422775232e-08, 0.8074135133612224, 0.5899859476645923],
)
NEXT_TO_HORIZON = (
    kc.Camera(
        0.0, 2.000006201771426, 0.2453624585610362, (0.013863024373954865, 0.002754177916516726, -0.010499303700420376)
    ),
    [-0.21784692846778264, 0.44623451702497247, -0.8679962393770163],
)


@pytest.mark.parametrize(
    ("case", "end", "direction", "time"),
    [
        (LONG_WAY, 100.0, [-0.8029674663879068, -0.27191089556374226, 0.5303844952450151], 200.6305330010575),
        (TANGENTIAL, None, [-2.4002423382760138e-08, -5.882922194341021e-16, 1.0], 4.929574023555624e-07),
        (NEXT_TO_HORIZON, None, [0.24557418912089876, 0.0, 0.9693777992287698], 3.048496573968569),
    ],
    ids=["long way", "tangential", "next to the horizon"],
)
def test_rays_to_a_sphere(case, end, direction, time):
    camera, sky = case
    ray = kc.trace_rays(camera, [sky], "closed-form", end=end or camera.radius, time=True)
    assert ray.escaped[0] and ray.closed_form[0]
    assert angle_between(ray.direction[0], np.array(direction)) < ray.error[0]
    assert abs(ray.time[0] - time) < ray.time_error[0]
    # N alone, in double precision, leaves 4e-9 open of the first, and nothing of the others.
    assert ray.error[0] < (1e-5 if end else 1e-11)


@pytest.mark.parametrize(
    ("camera", "sky", "end", "time"),
    [
        # Of small k.
        pytest.param(
            kc.Camera(
                0.9999999999675456,
                495.95084891816026,
                math.pi,
                (0.0005892022040629411, 0.0013686419482347113, 0.0010824940334464267),
            ),
            [0.8778610077202129, 0.32139925945780684, 0.35505290752847757],
            42489.49636727473,
            42002.45457985269,
        ),
        (
            kc.Camera(0.0, 2.000003585842417, 0.0, (0.8985210250067921, 0.23034968416100243, 0.3736291307000642)),
            [-6.933825758734129e-05, 0.9999999286505666, -0.00037133686576719394],
            2.000002,
            3.2070523998770093,
        ),
        pytest.param(
            kc.Camera(0.0, 3.0, 1.0183864219208278, (0.0, 0.0, 0.6142801183634814)),
            [-1.718948155934867e-06, 0.9349494170776401, 0.3547810416344514],
            kc.EquatorialPlane(1),
            12.411265796143473,
        ),
    ],
    ids=["from a sphere to one far out", "all next to the horizon", "close to the outer roots"],
)
def test_times_to_a_finite_end(camera, sky, end, time):
    ray = kc.trace_rays(camera, [sky], "closed-form", end=end, time=True)
    assert ray.closed_form[0] and abs(ray.time[0] - time) < ray.time_error[0] < 1e-6


@pytest.mark.parametrize(
    ("camera", "sky", "end"),
    [
        (
            kc.Camera(0.0, 3.0, 1.172050039375842),
            [-1.562352586697324e-08, 0.16451596687668787, 0.9863744201076123],
            kc.EquatorialPlane(3),
        ),
        (
            kc.Camera(0.19570639840039128, 272321374.3381674, 1.5707626215665103, (0.0, 0.0, 0.0)),
            [-0.13723000569625576, 0.09277954455324604, -0.9861845068997473],
            272318193.65428096,
        ),
    ],
    ids=["both outer roots at the camera", "far and brief"],
)
def test_errors_are_numbers(camera, sky, end):
    assert np.isfinite(kc.trace_rays(camera, [sky], "closed-form", end=end).error[0])


def test_the_azimuth_of_a_ray_from_the_axis_along_the_cut_is_known_modulo_a_turn():
    """Of -0.0 and 0.0 one is pi, the other - pi."""
    rays = kc.trace_rays(kc.Camera(0.0, 8.0, math.pi, (0.7, 0.0, 0.0)), [[0.0, 0.0, -1.0], [-0.0, 0.0, -1.0]], end=5.3)
    assert np.isinf(rays.azimuth_error).all()


def test_a_sphere_at_the_turning_point_is_not_certain():
    """The camera's radius is rounded too: whether a ray that starts at right angles comes back to it is not known."""
    camera, _ = TANGENTIAL
    sky = [[-1e-12, 0.8074135133612224, 0.5899859476645923], [-0.1, 0.8, 0.59]]
    assert kc.trace_rays(camera, sky, end=camera.radius).status_certain.tolist() == [False, True]


# (camera, N, direction of the end, columns of the Jacobian, index; largest errors of n' and of the Jacobian)
BEAMS = {
    "nearly extremal": (
        kc.Camera(0.999999999, 2.437168886730799, 1.0050190683136762, (0.0, 0.0, -2.012433143039468e-06)),
        [-0.8188515781726534, -0.5740048850785303, -0.0006962974496074765],
        [-0.140600748799386, -0.9900663316937516, -0.00029712544514646984],
        [
            [102191168072.19086, 145933129758.0346],
            [-14512314039.471302, -20724172624.34396],
            [-4126832.2088294, -5893286.351101331],
        ],
        13,
        (0.1, 0.1),
    ),
    "next to its horizon": (
        kc.Camera(
            0.9999999987395543,
            1.000053256320965,
            3.141592519514871,
            (0.236774978986659, 0.08795649484928975, -0.05136947391628978),
        ),
        [-0.1656233364073599, 0.9511521797359181, 0.2605349140151972],
        [-0.11983799142188922, 0.9046945478846002, 0.40886016049481505],
        [
            [68711.25285744568, 36263.66618540993],
            [-49588.828967017165, 20473.361908842133],
            [129865.82421897168, -34672.915946096684],
        ],
        0,
        (1e-8, 1e-8),
    ),
    "far": (
        kc.Camera(0.9995610757693673, 83163174.87548234),
        [-0.999999996934883, -3.0778338403657875e-05, -7.199255598664024e-05],
        [-0.9999999891932767, 0.00013083103207680286, 6.70573444802007e-05],
        [
            [-0.00019663486611920666, -0.00038356540975261253],
            [-1.5683260228130778, -2.127948942399815],
            [0.1275154611265451, -1.5682644471206117],
        ],
        1,
        (1e-12, 1e-7),
    ),
    "all digits lost": (
        kc.Camera(
            0.999999999,
            1.0000482626868055,
            math.pi / 2,
            (-3.995030356221689e-09, 3.58006774270298e-10, -8.51179607300895e-09),
        ),
        [-0.9266870732816148, -0.2577128371614206, -0.27356016116197607],
        [0.14891979035868777, 0.7148473929743099, 0.6832394168937834],
        [
            [4084858841750230.5, 3531278200576867.0],
            [-851593035561441.4, -736185028355374.9],
            [647999774239.4108, 560182754365.8381],
        ],
        143,
        (math.pi, 1.0),
    ),
}


@pytest.mark.parametrize("name", BEAMS)
def test_beams_to_infinity(name):
    camera, sky, direction, columns, index, (most, most_bent) = BEAMS[name]
    beam = kc.trace_beams(camera, [sky], "closed-form")
    assert beam.escaped[0] and beam.closed_form[0]
    assert angle_between(beam.direction[0], np.array(direction)) <= beam.error[0] <= most
    found = np.stack(polar_basis(beam.direction), axis=-1)[0] @ beam.jacobian[0]
    bent = np.linalg.norm(found - columns) / np.linalg.norm(columns, 2)
    # An error of 1 says that nothing is known: both may then differ by twice that.
    assert bent / 2 <= beam.diameter_error[0] <= most_bent
    assert bent <= beam.diameter_error[0] or beam.diameter_error[0] == 1
    assert beam.index[0] == index or not beam.index_certain[0]


def test_hair_over_the_plane():
    """The way is so short that its variation is left to the integrator."""
    camera = kc.Camera(
        0.999, 3.771942814089784, 1.5707963250299037, (-0.5292063802748511, 0.8151631818184711, 0.23547663387843926)
    )
    sky = [[0.0, 0.9999999822317516, -0.00018851126387340754]]
    beam = kc.trace_beams(camera, sky, end=kc.EquatorialPlane(1), redshift=False)
    true = [[6.110564217163068e-06, 1.3732783251279178e-05], [1.7760516622079276e-05, -7.902751787561496e-06]]
    assert beam.index[0] == 0
    assert beam.azimuth[0] == pytest.approx(-3.2055700438607805e-10, rel=1e-4)
    np.testing.assert_allclose(beam.jacobian[0], true, rtol=1e-5)


def test_rays_at_rounding_of_the_shadow_edge_are_not_certain():
    camera = kc.Camera(0.9, 4.0, 1.0, "fiducial")
    edge = kc.shadow_edge(camera, 16)
    assert not kc.trace_rays(camera, edge).status_certain.any()
    middle = edge.mean(axis=0) / np.linalg.norm(edge.mean(axis=0))
    for outward in (1e-6, -1e-6):
        beside = edge + outward * (edge - middle)
        rays = kc.trace_rays(camera, beside)
        assert rays.status_certain.all()
        assert (rays.escaped == (outward > 0)).all()


def test_rays_kept_in_the_plane_by_rounding_alone_have_no_certain_crossings():
    camera = kc.Camera(0.5, 9.0, math.pi / 2, (0.0, -0.3, 0.2))
    assert kc.trace_beams(kc.Camera(0.5, 9.0), [[0.6, 0.8, 0.0]]).crossings_certain[0]
    frame = camera.frame()
    found = kc.trace_beams(camera, in_plane(frame))
    assert not found.crossings_certain[np.abs(found.direction[:, 2]) == 0].any()


def in_plane(frame) -> np.ndarray:
    """Directions whose photons have no p_theta, within rounding."""
    turn = np.linspace(0.1, 1.4, 64)
    return sky_from_fido(frame, np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=-1))
