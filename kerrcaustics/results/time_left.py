"""The time that a job of many steps still needs, by the steps that are done."""

from itertools import pairwise

# Seconds left that are not worth saying, in which estimates are no longer true.
_SOON = 0.5


class TimeLeft:
    """Estimate of the time left, from the moments at which parts of a job were done.

    The first step of each process is left out: it loads too. So may one of the next ones: the longest of
    the others is left out, if there are three. Processes that began together end their steps together, so that only
    whole rounds of them are counted.
    """

    def __init__(self, at_once: int = 1) -> None:
        """at_once: steps that are at work at the same time."""
        self._at_once = max(at_once, 1)
        self._first_part: float | None = None
        self._marks: list[tuple[float, float]] = []

    def note(self, now: float, part: float) -> None:
        """Take note that a part of the whole job, 0 to 1, is done at a moment, seconds."""
        if self._first_part is None:
            self._first_part = part
        elif part > (self._marks[-1][1] if self._marks else self._first_part):
            self._marks.append((now, part))

    def seconds_in_all(self) -> float | None:
        """Seconds that all of the job takes at this rate; None before two rounds of steps are done."""
        ends = self._marks[self._at_once - 1 :: self._at_once]
        steps = sorted((now - then, part - before) for (then, before), (now, part) in pairwise(ends))
        kept = steps[:-1] if len(steps) > 2 else steps
        return sum(seconds for seconds, _ in kept) / sum(part for _, part in kept) if kept else None

    def seconds_left(self, now: float) -> float | None:
        """Seconds left at a moment; None before two rounds of steps are done, and if the last one is overdue.

        While the present round takes longer than those before, the time of those to come is left.
        """
        whole, last = self.seconds_in_all(), self._last_of_round()
        if whole is None or last is None:
            return None
        since, part = now - last[0], last[1] - self._marks[(self.rounds - 1) * self._at_once - 1][1]
        left = whole * (1 - last[1]) - min(since, whole * part)
        return left if left > _SOON else None

    @property
    def rounds(self) -> int:
        """Rounds of steps that are done, the first one too."""
        return len(self._marks) // self._at_once

    def _last_of_round(self) -> tuple[float, float] | None:
        return self._marks[self.rounds * self._at_once - 1] if self.rounds > 1 else None


def clock_in_words(seconds: float) -> str:
    """Hours, minutes and seconds, as 0:01:30."""
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02}:{whole % 60:02}"


def in_round_words(seconds: float) -> str:
    """A duration to two digits, in the unit that people would take."""
    for unit, length in (("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2 * length:
            return f"{float(f'{seconds / length:.2g}'):g} {unit}"
    return f"{float(f'{seconds:.2g}'):g} s"
