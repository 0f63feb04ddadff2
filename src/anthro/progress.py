"""Progress of long work: a bar on a terminal, a line every 30 s in a log."""

import sys
import time
from collections.abc import Iterable, Iterator
from typing import TypeVar

from tqdm import tqdm

Item = TypeVar("Item")
LINE_SECONDS = 30.0


def progress(iterable: Iterable[Item], total: int | None = None, label: str = "") -> Iterator[Item]:
    """Pass an iterable's items on and tell on stderr how far they are.

    Parameters
    ----------
    iterable : iterable
        The work's items.
    total : int, optional
        How many there are; taken from ``len`` if it has one.
    label : str
        What is being done, such as ``"right_arm_reflex epochs"``.

    Yields
    ------
    object
        The items, unchanged.
    """
    if total is None and hasattr(iterable, "__len__"):
        total = len(iterable)
    if sys.stderr.isatty():
        yield from tqdm(iterable, total=total, desc=label)
        return
    started = told = time.monotonic()
    done = 0
    for item in iterable:
        yield item
        done += 1
        if time.monotonic() - told >= LINE_SECONDS:
            told = time.monotonic()
            _tell(label, done, total, told - started)
    _tell(label, done, total, time.monotonic() - started)


def _tell(label: str, done: int, total: int | None, seconds: float) -> None:
    share = f"/{total} ({100 * done / total:.0f} %)" if total else ""
    print(f"{label}: {done}{share} in {seconds:.0f} s", file=sys.stderr, flush=True)
