"""Run Snakemake for one run, at most once at a time, with nothing that slows it down as jobs finish.

Snakemake's own locks outlive a killed process and then refuse the next run. The lock taken here is
the operating system's: it goes with the process that holds it, so that a killed run simply goes on.

Its command line always limits how many jobs start in a second. Under that limit each finished job
leaves behind a timer that has all waiting jobs weighed again every second: after a hundred jobs the
scheduler takes a core. Here there is no limit, unless an argument or the profile sets one.
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
    """Take a lock that ends with this process.

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
    return descriptor


def run_snakemake(arguments: Sequence[str]) -> bool:
    """Run Snakemake as its command line does, but with its API's default of no limit to the rate of starts.

    Parameters
    ----------
    arguments : sequence of str
        As after ``snakemake``.

    Returns
    -------
    bool
        Whether every job succeeded.
    """
    from snakemake.cli import args_to_api, parse_args  # imported late, for `take_lock` to be quick
    from snakemake.exceptions import print_exception
    from snakemake.settings.types import MaxJobsPerTimespan

    try:
        parser, settings = parse_args(list(arguments))
        default = MaxJobsPerTimespan.parse_choice(parser.get_default("max_jobs_per_timespan"))
        if vars(settings.max_jobs_per_timespan) == vars(default):
            settings.max_jobs_per_timespan = None
        return args_to_api(settings, parser)
    except Exception as error:  # as snakemake.cli.main
        print_exception(error)
        return False


def main(argv: Sequence[str] | None = None) -> int:
    """Take the run's lock and run Snakemake."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--run", required=True, help="name of the run")
    parser.add_argument("snakemake", nargs=argparse.REMAINDER, help="-- and Snakemake's arguments")
    given = parser.parse_args(argv)
    take_lock(Path(".snakemake") / "runs" / f"{given.run}.lock")
    arguments = given.snakemake[1:] if given.snakemake[:1] == ["--"] else given.snakemake
    return 0 if run_snakemake(["--nolock", *arguments]) else 1


if __name__ == "__main__":
    sys.exit(cli.run(main))
