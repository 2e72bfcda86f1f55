"""The engines by name."""

from collections.abc import Iterable
from enum import StrEnum

from kerrcaustics.spacetime.checks import one_of


class Engine(StrEnum):
    """Engines: the closed form, the integrator, or the more accurate of both, ray by ray."""

    AUTO = "auto"
    CLOSED_FORM = "closed-form"
    INTEGRATED = "integrated"


ENGINES = tuple(engine.value for engine in Engine)


def engine_named(name: object) -> Engine:
    """The engine of that name; a ValueError if there is none."""
    one_of("engine", name, ENGINES)
    return Engine(name)


def in_words(engines: Iterable[Engine]) -> str:
    """Names of engines as one text: "closed-form and integrated"."""
    return " and ".join(sorted(set(engines)))
