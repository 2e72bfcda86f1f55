"""The script of the page: plain files joined in order, one script for browsers, notebooks and saved pages."""

import json

from kerrcaustics.draw.palettes import THEMES
from kerrcaustics.explorer.state import PAGE

LOGIC = ("numbers", "state", "style", "answers", "questions", "freshness", "layers", "quiz_stars", "gif")
"""Files of `page/parts` that need no page: numbers, the state, answers, questions, what is old, layers,
lessons, GIF files."""

PARTS = (
    *LOGIC,
    # What panels draw.
    *(
        "pens",
        "label_spots",
        "words",
        "sky_panel",
        "celestial_map",
        "celestial_globe",
        "source_panel",
        "strip",
        "spectrum",
    ),
    # What users see and touch.
    *("elements", "terms", "canvases", "screen", "controls", "tables", "playback", "pointers"),
    *("exports", "status", "backdrop"),
    # Lessons.
    *("invitation", "tour", "quiz", "recording", "page"),
    *("shown", "explorer", "start"),
)
"""Files of `page/parts` in the order in which they are joined."""

LIVE = (
    # The search.
    *("vectors", "hole", "kernels", "lines", "critical_points", "critical_curves", "features"),
    *("winding", "sheets", "images", "orbit"),
    # Questions and answers.
    *("skies", "texts_of_state", "answers", "worker"),
)
"""Files of `page/live`, the program of a page without a server, in the order in which they are joined."""


def script(ending: str | None = None, parts: tuple[str, ...] = PARTS, *, live: bool = False) -> str:
    """The palettes of all pictures, parts of the script, and the file of `page` that starts them.

    live: True for a page that can compute its answers itself.
    """
    files = [_text(f"parts/{part}.js") for part in parts]
    files += [live_program(), _text("live.js")] if live else []
    files += [_text(f"{ending}.js")] if ending else []
    return "\n".join([f"const PALETTES = {json.dumps(THEMES)};", *files])


def live_program(files: tuple[str, ...] = LIVE) -> str:
    """A function of a worker's scope that answers its messages."""
    texts = [_text(f"live/{file}.js") for file in files]
    return "\n".join(['function liveProgram(scope) {\n"use strict";', *texts, "answerMessages(scope);\n}"])


def _text(file: str) -> str:
    return (PAGE / file).read_text(encoding="utf-8")
