"""The motion of a camera as numbers, for rays that are differentiated by its place."""

from typing import Any, NamedTuple

from kerrcaustics.spacetime.camera import Camera, Velocity

# Axes of a camera at rest, or in azimuthal motion.
_AXES = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))


class Moving(NamedTuple):
    """A camera's motion: its speed and axes, or an angular velocity in place of the speed.

    named, 1 for an angular velocity; orbits, 1 if that is the one of a circular orbit, else it is 0. All are numbers,
    so that one program serves every camera.
    """

    speed: Any
    axes: Any
    named: Any = 0.0
    orbits: Any = 0.0


def motion_of(velocity: Velocity) -> Moving:
    """The motion that a velocity of `Camera` stands for."""
    if isinstance(velocity, str) and velocity in ("circular", "static"):
        return Moving(0.0, _AXES, 1.0, float(velocity == "circular"))
    # Any place will do.
    frame = Camera(0.0, 10.0, velocity=velocity).frame()
    return Moving(frame.speed, frame.basis)
