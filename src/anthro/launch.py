"""Start Snakemake for one run, at most once at a time.

Snakemake's own locks outlive a killed process and then refuse the next run. The lock taken here is
the operating system's: it goes with the process that holds it, so that a killed run simply goes on.
"""

import argparse
import fcntl
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from anthro import cli
from anthro.errors import UserError


def take_lock(path: str | os.PathLike) -> int:
    """Take a lock that ends with this process (or what it turns into by ``exec``).

    Parameters
    ----------
    path : path-like
        The lock's file; made if missing.

    Returns
    -------
    int
        The file descriptor that holds the lock.

    Raises
    ------
    UserError
        When another process holds it.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise UserError(f"{path.stem}: this run is going on already in another process") from None
    os.set_inheritable(descriptor, True)
    return descriptor


def main(argv: Sequence[str] | None = None) -> None:
    """Take the run's lock and become Snakemake."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--run", required=True, help="name of the run")
    parser.add_argument("snakemake", nargs=argparse.REMAINDER, help="-- and Snakemake's arguments")
    given = parser.parse_args(argv)
    take_lock(Path(".snakemake") / "runs" / f"{given.run}.lock")
    arguments = given.snakemake[1:] if given.snakemake[:1] == ["--"] else given.snakemake
    sys.stdout.flush()
    os.execv(sys.executable, [sys.executable, "-m", "snakemake", "--nolock", *arguments])


if __name__ == "__main__":
    sys.exit(cli.run(main))
