"""A computation for the page, and what the page hears of it while it lasts."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from kerrcaustics.explorer.answers import Question, answer, refusal
from kerrcaustics.explorer.page_data import Message
from kerrcaustics.results.progress import listening
from kerrcaustics.results.stages import stages_timed

FIRST, PAUSE = 0.3, 1.0
"""Seconds before the first message about a computation, and between others: the page takes a silence for a loss."""


class Work:
    """An answer in the making; without a question it waits for its turn."""

    def __init__(self) -> None:
        """Begin to wait."""
        self.began = time.monotonic()
        self.stage = "waiting_for_other_pages"
        self.number: int | None = None
        self.want: str | None = None

    def answered(self, question: Question) -> tuple[Message, bytes]:
        """The answer to a question, and the same encoded; where there is none, the reason."""
        (number, want, *_), self.stage = question, "loading"
        self.number, self.want = number, want
        try:
            # Work for the page has no cell of its own.
            with listening(False), stages_timed(self._stands):
                message = answer(*question)
            return message, message.encoded()
        except Exception as error:
            line = f"This could not be computed ({type(error).__name__}): move a slider a little."
            message = refusal(line, number, want)
            return message, message.encoded()

    def _stands(self, stage: str, _seconds: dict[str, float]) -> None:
        self.stage = stage

    def progress(self) -> Message:
        """The question, the seconds so far, and the stage in words."""
        seconds, stage = time.monotonic() - self.began, self.stage.replace("_", " ")
        record = {"kind": "progress", "id": self.number, "want": self.want, "seconds": seconds, "stage": stage}
        return Message(record, {})

    @contextmanager
    def reported(self, send: Callable[[Message], None]) -> Iterator[None]:
        """Send messages about it from another thread, within the block."""
        over = threading.Event()

        def report() -> None:
            pause = FIRST
            while not over.wait(pause):
                send(self.progress())
                pause = PAUSE

        thread = threading.Thread(target=report, daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()
