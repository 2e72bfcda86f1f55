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


def script(ending: str | None = None, parts: tuple[str, ...] = PARTS) -> str:
    """The palettes of all pictures, parts of the script, and the file of `page` that starts them."""
    files = [f"parts/{part}.js" for part in parts] + ([f"{ending}.js"] if ending else [])
    texts = [(PAGE / file).read_text(encoding="utf-8") for file in files]
    return "\n".join([f"const PALETTES = {json.dumps(THEMES)};", *texts])
