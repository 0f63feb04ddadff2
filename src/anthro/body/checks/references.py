"""Published values in ``config/body/references``, read row by row."""

from __future__ import annotations

import csv
from pathlib import Path

from anthro.errors import UserError


def read(tables: Path, name: str) -> list[dict]:
    """Rows of ``references/<name>.csv``: numbers as float, empty cells of number columns None.

    Raises
    ------
    UserError
        The table is missing.
    """
    path = Path(tables) / "references" / f"{name}.csv"
    if not path.is_file():
        raise UserError(f"{path}: table of published values is missing")
    with path.open(newline="", encoding="utf-8") as stream:
        return [{key: _value(key, text) for key, text in row.items()} for row in csv.DictReader(stream)]


def _value(key: str, text: str):
    if not key.endswith(("_deg", "_m", "_Nm", "_fraction")) and key not in ("number", "positive") and key[:2] != "r_":
        return text
    return float(text) if text else None
