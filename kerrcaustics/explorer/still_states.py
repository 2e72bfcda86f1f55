"""States that a page without a program holds, for browsers that forbid it to compute.

Those of the usual page come with the package; others are computed when needed.

`python -m kerrcaustics.explorer.still_states` makes those of the package anew (page/states.xz).
"""

import json
import lzma
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from kerrcaustics.explorer.lessons import LESSONS, Lesson
from kerrcaustics.explorer.state import PAGE, ExplorerState
from kerrcaustics.files import writing
from kerrcaustics.results.progress import in_steps

CAMERAS = tuple(
    ExplorerState(spin=spin, radius=radius, theta=76.0, phi=330.0, orders=3 if spin == 0.5 else 2)
    for spin, radius in ((0.5, 6.03), (0.999, 6.03))
)
"""Few: they are shown where the page cannot compute."""
THETAS = (60.0, 86.0, 90.0)
"""Heights of stars, degrees; on each, all longitudes."""
SHIPPED = PAGE / "states.xz"
"""The messages that come with the package."""
_MOMENTS = 240

Request = tuple[str, ExplorerState]
"""The kind of a message, "view", "orbit", "shapes" or "waves", and its state."""


def requests(cameras: Iterable[ExplorerState], thetas: Iterable[float], tour: Iterable[Lesson]) -> list[Request]:
    """The messages of cameras with stars at some heights, and of a tour, each once."""
    heights = list(thetas)
    wanted: list[Request] = []
    for camera in cameras:
        wanted += [("view", camera), *(("orbit", replace(camera, theta=theta)) for theta in heights)]
    for lesson in tour:
        wanted += [(kind, lesson.state) for kind in kinds_of(lesson.state)]
    return list(dict.fromkeys(wanted))


def kinds_of(state: ExplorerState) -> list[str]:
    """The kinds of messages about the star of a lesson."""
    is_wanted = {"view": True, "shapes": state.size > 0, "waves": state.frequency > 0}
    return [kind for kind, wanted in is_wanted.items() if wanted]


def messages(wanted: list[Request]) -> dict[Request, bytes]:
    """Encoded messages: those of the package, and others, which are computed."""
    kept = read(SHIPPED)
    missing = [request for request in wanted if request not in kept]
    return {**kept, **_computed(missing)} if missing else kept


def _computed(wanted: list[Request]) -> dict[Request, bytes]:
    from kerrcaustics.explorer.answers import orbit_of, shapes_of, waves_of
    from kerrcaustics.explorer.page_data import view_of

    makers = {
        "view": view_of,
        "orbit": lambda state: orbit_of(state, _MOMENTS),
        "shapes": shapes_of,
        "waves": waves_of,
    }
    return {(kind, state): makers[kind](state).encoded() for kind, state in in_steps("state", wanted)}


def write(path: Path, kept: dict[Request, bytes]) -> None:
    """Write messages: a line of JSON with the kind, the state and the length of each, and the messages, compressed."""
    head = [[kind, state.record(), len(data)] for (kind, state), data in kept.items()]
    with writing(path) as file:
        file.write(lzma.compress(json.dumps(head).encode() + b"\n" + b"".join(kept.values()), preset=9))


def read(path: Path) -> dict[Request, bytes]:
    """The messages of a file; none if there is no such file."""
    if not path.exists():
        return {}
    head, _, body = lzma.decompress(path.read_bytes()).partition(b"\n")
    kept, start = {}, 0
    for kind, values, length in json.loads(head):
        kept[kind, ExplorerState.read(values)] = body[start : start + length]
        start += length
    return kept


if __name__ == "__main__":
    write(SHIPPED, _computed(requests(CAMERAS, THETAS, LESSONS)))
