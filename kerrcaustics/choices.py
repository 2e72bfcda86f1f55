"""Words that arguments are chosen from, as types: the command line knows them before anything heavy is loaded.

A word that is none of them may be close to one: `near` says which. Degrees may be radians: `if_radians` and
`place_if_radians` say so.
"""

import difflib
import math
import re
from collections.abc import Callable, Iterable, Sequence
from typing import Literal

VelocityName = Literal["circular", "fiducial", "static"]
"""Motions of a camera that have a name."""

ReleaseName = Literal["circular", "retrograde", "fiducial", "static"]
"""Velocities of a body on an orbit that have a name."""

SpotMotion = Literal["circular", "retrograde"]
"""Motions of a spot on its orbit."""

EventKind = Literal["creation", "annihilation"]
"""Kinds of pair events."""

EngineName = Literal["auto", "closed-form", "integrated"]
"""Engines that trace rays and beams."""

PlaneName = Literal["xy", "xz"]
"""Planes of plots in space: seen along the spin axis, from the side."""

Quality = Literal["draft", "normal", "high"]
"""Qualities of pictures."""


WaveMethod = Literal["auto", "images", "fold", "cusp", "ring", "line"]
"""Methods that compute the waves of a source."""

ShutterShape = Literal["box", "triangle", "cosine"]
"""Weights of the moments of an exposure."""


def event_kind(side: float) -> EventKind:
    """Kind of a pair event: side is positive if the pair exists where the source's time or coordinate is larger."""
    return "creation" if side > 0 else "annihilation"


def suggestion(word: object, names: Iterable[str]) -> str:
    """The name that a word may stand for, as the end of a sentence: "; did you mean spin?"; else its full stop.

    The hyphens of options do not make two names alike, and capitals no difference.
    """
    bare = {name.lstrip("-").lower(): name for name in names}
    similar = difflib.get_close_matches(str(word).lstrip("-").lower(), list(bare), n=1)
    return f"; did you mean {bare[similar[0]]}?" if similar else "."


# Signs that look like a minus, commas between thousands, and units in which numbers are given anyway.
_MINUS = re.compile("[\N{MINUS SIGN}\N{EN DASH}\N{FIGURE DASH}\N{NON-BREAKING HYPHEN}]")
_THOUSANDS = re.compile(r",(?=\d{3}(,|$))")
_UNITS = re.compile(r"\s*(\N{DEGREE SIGN}|deg|degrees|M|Msun|pc)$")


def number_suggestion(text: str, count: int = 1, kind: Callable[[str], float] = float) -> str:
    """The numbers that a text may stand for, as the end of a sentence: "; did you mean 0.9?"; else its full stop.

    It may have a decimal comma, commas between numbers or digits, a minus sign that is no hyphen, or a unit.
    """
    plain = _UNITS.sub("", _MINUS.sub("-", text).strip().rstrip(","))
    for meant in (plain, plain.replace(",", " "), plain.replace(",", ".", 1), _THOUSANDS.sub("", plain)):
        try:
            numbers = [kind(part) for part in meant.split()]
        except ValueError:
            continue
        if len(numbers) == count and meant != text:
            return f"; did you mean {meant}?"
    return "."


# Twelfths of pi that people write in radians: pi/6 to 2 pi. Rounded to three digits, pi/2 and pi are as far off.
_TWELFTHS, _AS_ROUNDED = (2, 3, 4, 6, 8, 9, 10, 12, 18, 24), 1e-3


def if_radians(name: str, degrees: float) -> str:
    """A line about an angle in degrees that is probably one in radians, a simple multiple of pi; empty for others."""
    parts = [n for n in _TWELFTHS if math.isclose(abs(degrees), n * math.pi / 12, rel_tol=_AS_ROUNDED)]
    if not parts:
        return ""
    meant = math.copysign(15 * parts[0], degrees)
    return f"{name} is in degrees, but {degrees:.12g} looks like radians: that would be {meant:g} degrees."


def place_if_radians(name: str, theta: float, phi: float) -> str:
    """A line about theta' and phi' in degrees that are probably in radians; empty for others.

    Small numbers, not both whole: hardly any source lies so close to the axis and to the camera's azimuth.
    """
    whole = float(theta).is_integer() and float(phi).is_integer()
    if whole or not (0 < theta <= math.pi + _AS_ROUNDED and abs(phi) <= 2 * math.pi + _AS_ROUNDED):
        return ""
    meant = f"{math.degrees(theta):.6g} {math.degrees(phi):.6g}"
    return f"{name} is in degrees, but {theta:.12g} {phi:.12g} looks like radians: that would be {meant} degrees."


def either(words: Sequence[str]) -> str:
    """Words as alternatives: "circular, fiducial or static"."""
    return " or ".join(part for part in (", ".join(words[:-1]), *words[-1:]) if part)
