"""Run cards: what made an artefact, written beside it."""

import os
import platform
import subprocess
import time
from importlib import metadata
from pathlib import Path

from anthro.files import digest, write_json

PACKAGES = ("numpy", "scipy", "mujoco", "myo-sim", "h5py", "torch")


def git_commit() -> str:
    """Return the commit of the source tree, "-dirty" added if it is modified, or "unknown"."""
    try:
        told = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"],
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            timeout=10,
        )
    except (OSError, subprocess.TimeoutExpired):
        return "unknown"
    return told.stdout.strip() if told.returncode == 0 else "unknown"


def package_versions() -> dict[str, str]:
    """Return the versions of Python and of the installed packages that decide a result."""
    versions = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return versions


class RunCard:
    """Write a run card when the block ends well, and nothing when it raises.

    Parameters
    ----------
    path : path-like
        The card's file (JSON).
    spec : dict
        What was asked for; the card carries it and its digest.
    seed : int, optional
        The run's seed.
    device : str
        Where the work was done, "cpu" or "cuda".

    Examples
    --------
    >>> with RunCard("out/run_card.json", spec={"pairs": 10}, seed=1) as card:  # doctest: +SKIP
    ...     card.note(pairs_per_second=900.0)
    """

    def __init__(self, path: str | os.PathLike, spec: dict, seed: int | None = None, device: str = "cpu"):
        self.path = Path(path)
        self.content = {"spec": spec, "spec_digest": digest(spec), "seed": seed, "device": device}

    def note(self, **values) -> None:
        """Add or replace entries of the card."""
        self.content.update(values)

    def __enter__(self) -> "RunCard":
        """Start the clock."""
        self._started = time.perf_counter()
        return self

    def __exit__(self, kind, error, traceback) -> None:
        """Write the card, if all went well."""
        if kind is not None:
            return
        self.note(
            wall_seconds=round(time.perf_counter() - self._started, 3),
            git_commit=git_commit(),
            versions=package_versions(),
        )
        write_json(self.path, self.content)
