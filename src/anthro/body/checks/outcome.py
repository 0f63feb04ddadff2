"""What a check hands back: rows for the scorecard, and details for the report."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

PAPER_OF = {"zhou2021": "zhou2021"}
DEFAULT_PAPER = "nakada2018"


@dataclass
class Outcome:
    """Rows of one check, as :func:`anthro.scorecard.judge` takes them, and its details (JSON-ready)."""

    variant: str
    name: str
    rows: list[dict] = field(default_factory=list)
    details: dict = field(default_factory=dict)

    def add(self, metric, value, unit="1", target=None, sense="info", source="anatomy", part=None) -> None:
        """Add a row; ``sense`` says whether the value may be at most, at least or exactly the target.

        ``part`` tells apart rows of one metric, such as ``elbow``.
        """
        item = f"body {self.variant}: {self.name.replace('_', ' ')}"
        self.rows.append(
            {
                "paper": PAPER_OF.get(self.variant, DEFAULT_PAPER),
                "item": f"{item}, {part}" if part else item,
                "metric": metric,
                "value": float(value),
                "unit": unit,
                "target": target,
                "sense": sense,
                "source": source,
            }
        )


def factor(ours: float, published: float) -> float:
    """By which factor (1 or more) a value misses a published one of the same sign; inf for another sign."""
    if not ours * published > 0.0:
        return math.inf
    return max(ours / published, published / ours)


def factor_to_band(ours: float, low: float, high: float) -> float:
    """By which factor a value of 0 or more lies outside a published band; 1 inside it."""
    if low <= ours <= high:
        return 1.0
    return factor(ours, low if ours < low else high)
