"""The stretch reflex and the accumulation of neural drive (Nakada et al. 2018, Eq. 1, 4, 5)."""

from __future__ import annotations

import numpy as np

STRAIN_GAIN = 8.0  # k_p
STRAIN_RATE_GAIN = 0.05  # k_d, s
SATURATION = 2.0  # m, 1/s
DRIVE_RANGE = (-4.0, 4.0)  # neural drive stays in here; muscles see it clipped to [0, 1]


def reflex_adjustment(strain_change, strain_rate_change):
    """Activation adjustment that a change of strain calls for (Eq. 4, 5).

    The reflex's input is the change over one control step (Fig. 7), now minus before, so that a
    stretched muscle contracts; Eq. 1 adds the adjustments up to k_p (strain - threshold).

    Parameters
    ----------
    strain_change, strain_rate_change : (..., n), dimensionless and 1/s.

    Returns
    -------
    ndarray
        (..., n) adjustment of neural drive.
    """
    return STRAIN_GAIN * strain_change + STRAIN_RATE_GAIN * np.clip(strain_rate_change, -SATURATION, SATURATION)


def accumulate(drive, voluntary, reflex):
    """Neural drive after one control step, a + (da_v + da_r) (Eq. 1), kept in ``DRIVE_RANGE``.

    The sum is kept unclipped at 0 and 1, so that the drive of silent muscles still says where the
    limb is; :func:`activation` is what the muscles see.
    """
    return np.clip(drive + (voluntary + reflex), *DRIVE_RANGE)


def activation(drive):
    """Muscle activation (..., n) in [0, 1] of a neural drive."""
    return np.clip(drive, 0.0, 1.0)
