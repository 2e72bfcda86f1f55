"""A check: what was compared with what, by how much it misses, and what it must keep."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """A line of the study."""

    name: str
    against: str
    miss: float
    bound: float
    unit: str

    @property
    def verdict(self) -> str:
        """In words."""
        return "holds" if self.miss <= self.bound else "fails"
