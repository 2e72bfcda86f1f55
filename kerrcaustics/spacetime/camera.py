"""Cameras: place and velocity, the camera's frame, and the photon behind each direction of its sky."""

import math
from fractions import Fraction
from functools import lru_cache
from typing import Any, ClassVar, NamedTuple

import numpy as np

from kerrcaustics.results.declared import quantity, result
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import apart, quoted, real_number, refuse_traced

Velocity = str | tuple[float, float, float]

# A camera that turns slower than this part of its terms stands still.
_ROUND_OFF = 1e-12
# Speed above which sums with it are written so that they do not cancel.
_FAST = 0.5
# Beyond it the hole is too small on the sky for double precision.
LARGEST_RADIUS = 1e9

VELOCITY_NAMES = ("circular", "fiducial", "static")


class Frame(NamedTuple):
    """The numbers of a camera that rays need, as a tree of floats that can go into compiled code.

    basis is the camera basis, rows e_x, e_y, e_z, in FIDO components (r, theta, phi); speed is the camera's
    speed beta measured by the FIDO, along e_y, and slowness = 1 - beta^2; the rest are metric functions at the camera.
    zoom, below 1 for an `Observer`, magnifies the sky about the direction to the hole: see `zoomed`; cylindrical_scale
    is multiplied by it. start, r + 2 ln r, is what the time to the camera is counted from, 0 for an `Observer`.
    """

    spin: float
    radius: float
    sin_theta: float
    cos_theta: float
    lapse: float
    shift: float
    cylindrical_scale: float
    root_sigma: float
    root_sigma_delta: float
    speed: float
    slowness: float
    basis: tuple[tuple[float, float, float], ...]
    zoom: Any
    start: Any


class Photon(NamedTuple):
    """Constants and first values of a photon of unit energy at infinity, followed backward in Mino time.

    b axial angular momentum; k = q + b^2; kappa = q + (b - a)^2; q Carter constant; u = 1/r and its rate;
    m = (x, y, z), the unit vector that carries theta and the smooth part of phi, and its rate.
    energy_ratio = E_infinity / E_FIDO: at or below zero there is no such photon from infinity.
    """

    b: Any
    k: Any
    kappa: Any
    q: Any
    position: tuple[Any, Any, Any, Any]
    rate: tuple[Any, Any, Any, Any]
    energy_ratio: Any


@result("camera/1", eq=True)
class Camera:
    """A camera at rest in its own frame at one event outside the horizon of a Kerr black hole.

    Parameters
    ----------
    spin : float
        Spin a of the hole, 0 <= a < 1, along +z (units of the mass).
    radius : float
        Boyer-Lindquist radius, outside the horizon, at most 1e9.
    inclination : float
        Polar angle of the camera in radians, 0 to pi; pi/2 is the equator.
    velocity : str or (float, float, float), optional
        "circular" (prograde equatorial geodesic), "fiducial" (at rest with respect to the FIDO), "static"
        (at rest in Boyer-Lindquist coordinates), or a vector (v_r, v_theta, v_phi) measured by the FIDO.
        Left out, it becomes "circular" where there is such an orbit, else "fiducial".

    Raises
    ------
    ValueError
        Where an argument cannot be; the message names it, and what it must be.

    Notes
    -----
    The camera's azimuth is 0. Camera basis, with B the unit direction of motion: e_y = B, e_x perpendicular
    to B in the plane of e_r and e_phi, e_z = e_x x e_y (JTFT A.1). At rest, and for azimuthal
    motion, e_x = e_r, e_y = e_phi, e_z = -e_theta.

    References: JTFT appendix A.1.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.999, radius=6.03)
    >>> camera.velocity
    'circular'
    """

    spin: float = quantity("", "1", "spin a of the hole")
    radius: float = quantity("", "GM/c^2", "Boyer-Lindquist radius")
    inclination: float = quantity("", "rad", "polar angle", given=True, default=math.pi / 2)
    velocity: Velocity | None = quantity("", "", "name, or vector measured by the FIDO", default=None)
    is_distant: ClassVar[bool] = False

    def __post_init__(self) -> None:
        """Refuse a camera that cannot be there."""
        object.__setattr__(self, "spin", _number("spin", self.spin))
        object.__setattr__(self, "radius", _number("radius", self.radius))
        object.__setattr__(self, "inclination", _number("inclination", self.inclination))
        if not 0 <= self.spin < 1:
            raise ValueError(f"Argument `spin` must lie in [0, 1), but is {self.spin:g}.")
        if not self.radius > kerr.horizon(self.spin):
            radius, horizon = apart(self.radius, kerr.horizon(self.spin))
            raise ValueError(f"Argument `radius` must be larger than the horizon radius {horizon}, but is {radius}.")
        if self.radius > LARGEST_RADIUS:
            raise ValueError(f"Argument `radius` must be at most {LARGEST_RADIUS:g}, but is {self.radius:g}.")
        if not 0 <= self.inclination <= math.pi:
            raise ValueError(f"Argument `inclination` must lie in [0, pi] radians, but is {self.inclination:g}.")
        if self.velocity is None:
            orbits = self.on_equator and self.radius > kerr.photon_orbits(self.spin)[0]
            object.__setattr__(self, "velocity", "circular" if orbits else "fiducial")
        elif not isinstance(self.velocity, str):
            object.__setattr__(self, "velocity", _velocity_vector(self.velocity))
        self.fido_velocity()

    def fido_velocity(self) -> tuple[float, float, float]:
        """Velocity (v_r, v_theta, v_phi) of the camera as measured by the fiducial observer (FIDO).

        References: JTFT A.1 for "circular".
        """
        if isinstance(self.velocity, tuple):
            return self.velocity
        if self.velocity not in VELOCITY_NAMES:
            raise ValueError(
                "Argument `velocity` must be circular, fiducial, static or a vector (v_r, v_theta, v_phi), "
                f"but is {quoted(self.velocity)}."
            )
        if self.velocity == "fiducial":
            return (0.0, 0.0, 0.0)
        at = kerr.metric(self.spin, self.radius, self.cos_theta)
        varpi = at.cylindrical_scale * self.sin_theta
        if self.velocity == "static":
            limit = kerr.ergosphere(self.spin, self.cos_theta)
            if not self.radius > limit:
                raise ValueError(
                    "Argument `velocity` must not be static at or inside the ergosphere "
                    f"(radius {self.radius:g} is not above {limit:.6g})."
                )
            return (0.0, 0.0, -at.shift * varpi / at.lapse)
        if self.cos_theta != 0:
            raise ValueError(
                "Argument `velocity` must not be circular off the equator "
                f"(inclination {math.degrees(self.inclination):.12g} degrees is not 90)."
            )
        photon_orbit = kerr.photon_orbits(self.spin)[0]
        if not self.radius > photon_orbit:
            raise ValueError(
                "Argument `velocity` must not be circular at or inside the photon orbit "
                f"(radius {self.radius:g} is not above {photon_orbit:.6g})."
            )
        orbital = 1 / (self.spin + self.radius**1.5)
        return (0.0, 0.0, varpi * (orbital - at.shift) / at.lapse)

    @property
    def cos_theta(self) -> float:
        """Cosine of the inclination, exactly 0 at math.pi / 2."""
        return 0.0 if self.inclination == math.pi / 2 else math.cos(self.inclination)

    @property
    def sin_theta(self) -> float:
        """Sine of the inclination, exactly 0 at math.pi as at 0."""
        return 0.0 if self.inclination == math.pi else math.sin(self.inclination)

    @property
    def on_equator(self) -> bool:
        """True when the camera lies in the equatorial plane, so that its sky has a mirror symmetry."""
        return self.cos_theta == 0

    @property
    def on_axis(self) -> bool:
        """True when the camera lies on the spin axis, so that its sky has an axial symmetry."""
        return self.sin_theta == 0

    def at_rest(self) -> "Camera":
        """The fiducial camera at the same event: same caustics, another sky."""
        return Camera(self.spin, self.radius, self.inclination, "fiducial")

    def frame(self) -> Frame:
        """The camera's numbers for compiled code."""
        return _frame(self)


@lru_cache(maxsize=64)
def _frame(camera: Camera) -> Frame:
    at = kerr.metric(camera.spin, camera.radius, camera.cos_theta)
    velocity = camera.fido_velocity()
    speed, basis = _basis(velocity)
    return Frame(
        spin=camera.spin,
        radius=camera.radius,
        sin_theta=camera.sin_theta,
        cos_theta=camera.cos_theta,
        lapse=at.lapse,
        shift=at.shift,
        cylindrical_scale=at.cylindrical_scale,
        root_sigma=math.sqrt(at.sigma),
        root_sigma_delta=math.sqrt(at.sigma * at.delta),
        speed=speed,
        # Exactly: close to the speed of light nothing of it would be left.
        slowness=float(1 - sum(Fraction(v) ** 2 for v in velocity)),
        basis=basis,
        zoom=1.0,
        start=camera.radius + 2 * math.log(camera.radius),
    )


def check_camera(camera: object, *, distant: bool = False) -> None:
    """Refuse what is not a Camera; distant, whether it may be an `Observer`."""
    if not isinstance(camera, Camera) or (camera.is_distant and not distant):
        kinds = "a Camera or an Observer" if distant else "a Camera"
        raise ValueError(f"Argument `camera` must be {kinds}, but is {type(camera).__name__}.")


def orbital_velocity(camera: Camera) -> float:
    """Angular velocity (coordinate azimuth per coordinate time) of a camera that circles the spin axis."""
    check_camera(camera)
    v_r, v_theta, v_phi = camera.fido_velocity()
    frame = camera.frame()
    scale = frame.cylindrical_scale * frame.sin_theta
    own = frame.lapse * v_phi / scale if scale > 0 else 0.0
    angular_velocity = frame.shift + own
    turns = scale > 0 and abs(angular_velocity) > _ROUND_OFF * (abs(frame.shift) + abs(own))
    if v_r != 0 or v_theta != 0 or not turns:
        raise ValueError(
            "Argument `camera` must orbit the spin axis (a purely azimuthal velocity, and an angular velocity that is "
            f"not 0), but is {camera}."
        )
    return angular_velocity


def fido_from_sky(frame: Frame, sky: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
    """Direction of motion (n_r, n_theta, n_phi) of the photon seen in camera-sky direction N (JTFT A.1).

    sky holds the components N_x, N_y, N_z, floats or arrays.
    """
    x, _, z = sky
    boost, aberration = doppler(frame, sky)
    shrink = -(frame.slowness**0.5)
    along = (shrink * x / boost, aberration / boost, shrink * z / boost)
    r, theta, phi = (sum(along[i] * frame.basis[i][j] for i in range(3)) for j in range(3))
    return r, theta, phi


def doppler(frame: Frame, sky: tuple[Any, Any, Any]) -> tuple[Any, Any]:
    """1 - beta y and beta - y, which do not cancel where a camera close to the speed of light looks along its motion.

    Floats, NumPy or JAX arrays: a truth value as a factor chooses between two forms.
    """
    x, y, z = sky
    beta = frame.speed
    sense = 2 * (beta >= 0) - 1
    toward, beta_size = sense * y, sense * beta
    ahead = toward > 0
    # 1 - |y|, and 1 - |beta|.
    near = ahead * (x * x + z * z) / (1 + ahead * toward) + (1 - ahead) * (1 - toward)
    slow = frame.slowness / (1 + beta_size)
    fast = beta_size > _FAST
    boost = fast * (slow + beta_size * near) + (1 - fast) * (1 - beta * y)
    return boost, fast * sense * (near - slow) + (1 - fast) * (beta - y)


def sky_from_fido(frame: Frame, direction: np.ndarray) -> np.ndarray:
    """Camera-sky direction N (..., 3) of photons that move along `direction` (..., 3) = (n_r, n_theta, n_phi).

    The inverse of `fido_from_sky`.
    """
    along = np.asarray(direction) @ np.asarray(frame.basis).T
    boost, aberration = doppler(frame, (along[..., 0], along[..., 1], along[..., 2]))
    shrink = -math.sqrt(frame.slowness)
    parts = [shrink * along[..., 0] / boost, aberration / boost, shrink * along[..., 2] / boost]
    sky = np.stack(parts, axis=-1)
    return sky / np.linalg.norm(sky, axis=-1, keepdims=True)


def looking_from_sky(frame: Frame, sky: np.ndarray) -> np.ndarray:
    """Direction (..., 3) in FIDO components in which the camera looks at N (..., 3): against the photon's motion."""
    return -np.stack(fido_from_sky(frame, tuple(np.moveaxis(np.asarray(sky), -1, 0))), axis=-1)


def sky_from_looking(frame: Frame, looking: np.ndarray) -> np.ndarray:
    """Camera-sky direction N (..., 3) of what lies in the direction `looking` (..., 3) = (r, theta, phi) of the FIDO.

    The inverse of `looking_from_sky`.
    """
    return sky_from_fido(frame, -np.asarray(looking))


def photon(frame: Frame, sky: tuple[Any, Any, Any]) -> Photon:
    """The photon that arrives from camera-sky direction N, with unit energy at infinity.

    sky holds the components N_x, N_y, N_z, floats or arrays of one shape. The rates are those of the
    photon's path followed backward in Mino time.

    References: JTFT A.1; K and kappa are written as sums of squares, so that they keep their
    digits near the principal null directions.
    """
    n_r, n_theta, n_phi = zoomed(frame, fido_from_sky(frame, sky))
    a, s, c = frame.spin, frame.sin_theta, frame.cos_theta
    energy_ratio = _energy_ratio(frame, n_phi)
    energy = 1 / energy_ratio
    p_theta = energy * frame.root_sigma * frame.zoom * n_theta
    p_phi = energy * frame.cylindrical_scale * n_phi
    b = p_phi * s
    u = 1 / frame.radius
    u_rate = u * u * energy * frame.root_sigma_delta * n_r
    zero = 0 * b
    return Photon(
        b=b,
        k=p_theta**2 + p_phi**2 - (a * c) ** 2,
        kappa=p_theta**2 + (p_phi - a * s) ** 2,
        q=p_theta**2 + c * c * (p_phi - a) * (p_phi + a),
        position=(u + zero, s + zero, zero, c + zero),
        rate=(u_rate, -c * p_theta, -p_phi, s * p_theta),
        energy_ratio=energy_ratio,
    )


def zoomed(frame: Frame, direction: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
    """Direction (n_r, n_theta / zoom, n_phi / zoom) in which a photon moves, from that on a magnified sky.

    Tangents of half the angle from the direction to the hole are multiplied by the zoom: angles stay, and both skies
    are whole. For a zoom of 1 nothing changes, to the bit.
    """
    n_r, n_theta, n_phi = direction
    square = frame.zoom * frame.zoom
    # Far out on a magnified sky 1 + n_r would cancel: it is told by the other two.
    far = (frame.zoom != 1) & (n_r < 0)
    toward = (n_theta * n_theta + n_phi * n_phi) / (1 - far * n_r) - square * (1 - n_r)
    along = (1 - far) * ((1 - square) + (1 + square) * n_r) + far * toward
    # Never 0, also straight away from the hole.
    size = (1 - far) * ((1 + square) + (1 - square) * n_r) + far * (toward + 2 * square * (1 - n_r)) + 1e-40
    return along / size, 2 * n_theta / size, 2 * n_phi / size


def _energy_ratio(frame: Frame, n_phi: Any) -> Any:
    """Energy at infinity per energy at the FIDO of a photon that moves there with the component n_phi / zoom."""
    return frame.lapse + frame.shift * frame.cylindrical_scale * frame.sin_theta * n_phi


def redshift(camera: Camera, sky: np.ndarray, light: Photon | None = None) -> np.ndarray:
    """Frequency ratio nu_camera / nu_source of light from a source at rest at infinity (JTFT A.1).

    Parameters: sky (..., 3), unit vectors; light, the photons from there, where they are known. Returns (...,).
    Errors: exact to round-off.
    """
    frame = camera.frame()
    parts = (sky[..., 0], sky[..., 1], sky[..., 2])
    energy_ratio = (
        _energy_ratio(frame, zoomed(frame, fido_from_sky(frame, parts))[2]) if light is None else light.energy_ratio
    )
    with np.errstate(divide="ignore"):
        return math.sqrt(frame.slowness) / (doppler(frame, parts)[0] * energy_ratio)


def _number(name: str, value: Any) -> float:
    number = real_number(name, value)
    if not math.isfinite(number):
        raise ValueError(f"Argument `{name}` must be a finite number, but is {quoted(value)}.")
    return number


def _velocity_vector(value: Any) -> tuple[float, float, float]:
    try:
        parts = tuple(real_number("velocity", v) for v in value)
    except TypeError as error:
        refuse_traced("velocity", error)
        parts = ()
    if len(parts) != 3 or not all(math.isfinite(v) for v in parts):
        raise ValueError(
            f"Argument `velocity` must be circular, fiducial, static or three finite numbers, but is {quoted(value)}."
        )
    speed = math.hypot(*parts)
    if not speed < 1:
        raise ValueError(f"Argument `velocity` must have a speed below 1 (light), but has {speed:g}.")
    return parts


def _basis(velocity: tuple[float, float, float]) -> tuple[float, tuple[tuple[float, float, float], ...]]:
    """Speed and camera basis, rows (e_x, e_y, e_z), for a FIDO velocity (JTFT A.1)."""
    speed = math.hypot(*velocity)
    if speed == 0:
        return 0.0, ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
    # Twice, so that the direction is a unit vector for the smallest numbers too.
    direction = [v / speed for v in velocity]
    b_r, b_theta, b_phi = (v / math.hypot(*direction) for v in direction)
    # Azimuthal motion keeps its sign in the speed, so that the basis does not turn over between the two senses.
    if b_r == 0 and b_theta == 0:
        return velocity[2], ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
    kappa = math.hypot(b_r, b_phi)
    # Motion along e_theta alone leaves e_x undetermined: e_r is the limit of the azimuthal case.
    c, s = (b_phi / kappa, b_r / kappa) if kappa > 0 else (1.0, 0.0)
    return speed, ((c, 0.0, -s), (b_r, b_theta, b_phi), (b_theta * s, -kappa, b_theta * c))
