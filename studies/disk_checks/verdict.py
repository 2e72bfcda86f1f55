"""A check: what was compared with what, by how much it misses, and what it must keep."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """One line of the study. `comparable` is False where what the other program means is not known."""

    name: str
    against: str
    miss: float
    bound: float
    unit: str
    comparable: bool = True

    @property
    def verdict(self) -> str:
        """In words."""
        if not self.comparable:
            return "not reproduced"
        return "holds" if self.miss <= self.bound else "fails"
