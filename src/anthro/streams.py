"""Named random streams: every draw belongs to a run's seed, a stage and a shard."""

from zlib import crc32

import numpy as np

from anthro.errors import UserError


def stream(run_seed: int, stage: str, shard: int = 0) -> np.random.Generator:
    """Return the random generator of one stage and shard.

    Parameters
    ----------
    run_seed : int
        The run's seed, at least 0.
    stage : str
        The stage's name, such as ``"right_arm_voluntary/round1"``.
    shard : int
        The shard's number, at least 0.

    Returns
    -------
    numpy.random.Generator
        Equal arguments give equal draws; any other stage or shard gives independent ones.

    Raises
    ------
    UserError
        When the seed or the shard is negative.
    """
    if run_seed < 0 or shard < 0:
        raise UserError(f"seed {run_seed}, shard {shard}: neither may be negative")
    return np.random.default_rng(np.random.SeedSequence([run_seed, crc32(stage.encode()), shard]))
