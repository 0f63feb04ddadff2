"""Rows of the scorecard under the paper of 1998, and what every command line here writes."""

from __future__ import annotations

from pathlib import Path

from anthro.files import write_json, write_shard

PAPER = "grzeszczuk1998"


def row(item: str, metric: str, value, unit: str, target=None, sense: str = "info", source: str = "project") -> dict:
    """One row; ``sense`` says on which side of the target is good."""
    value = None if value is None else float(value)
    keys = ("paper", "item", "metric", "value", "unit", "target", "sense", "source")
    return dict(zip(keys, (PAPER, item, metric, value, unit, target, sense, source), strict=True))


def write(out: Path, metrics: dict, rows: list[dict], columns: dict | None = None) -> None:
    """Write ``metrics.json``, ``rows.json`` and, where there are columns, ``rollout.h5``."""
    if columns:
        write_shard(out / "rollout.h5", columns)
    write_json(out / "metrics.json", metrics)
    write_json(out / "rows.json", rows)
