"""Fit fiber and tendon lengths to our own geometry, so that every fiber works where it should.

Tendon lengths printed for another geometry leave fibers slack or torn on this one, and the papers'
passive spring (exponent 6) turns 20 % of stretch into twice the muscle's strength. The fit keeps
the source's optimal fiber length where it can and lengthens it where the joint ranges ask for more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anthro.body.parts import twins

SHORTEST, LONGEST = 0.6, 1.08  # fiber length over l0 at the ends of the sampled lengths
SHORTEST_OF_ALL = 0.54
NEUTRAL = 1.02  # at most, in the neutral posture: a tenth of the muscle's strength
HARD_LIMITS = (0.5, 1.6)


@dataclass(frozen=True)
class FiberFit:
    """Fitted lengths of n muscles in m, and what the fibers do over the sampled postures.

    Attributes
    ----------
    slack_length, tendon_length : (n,) m.
    shortest, longest : (n,) fiber length over slack length at the extremes.
    """

    slack_length: np.ndarray
    tendon_length: np.ndarray
    shortest: np.ndarray
    longest: np.ndarray

    @property
    def outside(self) -> np.ndarray:
        """(n,) bool: fibers that leave 0.5 to 1.6 l0."""
        return (self.shortest < HARD_LIMITS[0]) | (self.longest > HARD_LIMITS[1])


def twins_share(lengths: np.ndarray, names: list[str]) -> np.ndarray:
    """Lengths (2 count, n): each muscle's and its twin's pooled, so that both sides get one fit."""
    return np.sort(np.concatenate([lengths, lengths[:, twins(names)]]), axis=0)


def fit_fibers(lengths: np.ndarray, optimal_length: np.ndarray, neutral: np.ndarray) -> FiberFit:
    """Fit slack and tendon lengths to sampled path lengths.

    The longest path (99.5 % quantile, so that one odd corner does not decide) gets a fiber of
    1.08 l0, where the passive spring pulls with half the muscle's strength; l0 is the source's
    unless the excursion needs more: 0.6 l0 at the 0.5 % quantile, 0.54 l0 at the shortest of all. In
    the neutral posture no fiber is longer than 1.02 l0, so that a limp body stands at ease.

    Parameters
    ----------
    lengths : (count, n) path lengths over the joint ranges, m.
    optimal_length : (n,) the source's optimal fiber lengths, m.
    neutral : (n,) path lengths in the neutral posture, m.
    """
    low, high = np.quantile(lengths, [0.005, 0.995], axis=0)
    slack = np.maximum(optimal_length, (high - low) / (LONGEST - SHORTEST))
    shortest = lengths.min(0)
    slack = np.maximum(slack, (high - shortest) / (LONGEST - SHORTEST_OF_ALL))
    slack = np.maximum(slack, (neutral - shortest) / (NEUTRAL - SHORTEST_OF_ALL))
    slack = np.minimum(slack, high / LONGEST)  # a tendon is never shorter than nothing
    tendon = np.maximum(high - LONGEST * slack, neutral - NEUTRAL * slack)
    return given_fibers(lengths, slack, tendon)


def given_fibers(lengths: np.ndarray, slack: np.ndarray, tendon: np.ndarray) -> FiberFit:
    """What fibers of given slack and tendon lengths (n,) m do over sampled path lengths (count, n) m."""
    return FiberFit(
        slack_length=slack,
        tendon_length=tendon,
        shortest=(lengths.min(0) - tendon) / slack,
        longest=(lengths.max(0) - tendon) / slack,
    )
