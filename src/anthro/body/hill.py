"""The linearized Hill muscle of Zhou et al. 2021, Appendix B, Eq. 1 and 2: one implementation.

Tendons are inextensible, so the fiber length is the path length less the tendon length. Every
function is elementwise: a NumPy ufunc of arrays, and of numbers in compiled code.
"""

from __future__ import annotations

import numpy as np
from numba import vectorize

STIFFNESS_PER_FORCE = 0.8  # k_s = 0.8 A
DAMPING_PER_STIFFNESS = 0.1  # k_d = 0.1 k_s, in seconds
EXPONENT = 6.0  # k_c
MIN_LENGTH = 0.3  # l_m / l_0
MAX_SPEED = 8.0  # v_m / l_0, in 1/s


@vectorize(cache=True)
def strain(fiber_length, slack_length):
    """Strain e = (l - l0) / l0, dimensionless."""
    return (fiber_length - slack_length) / slack_length


@vectorize(cache=True)
def active_force(e, e_rate, max_force):
    """Force of a fully active contractile element, F_l F_v (Eq. 2).

    Parameters
    ----------
    e : strain, dimensionless.
    e_rate : strain rate, 1/s, negative when shortening.
    max_force : A, the isometric force at slack length, N.

    Returns
    -------
    ndarray
        Force at activation one, N.
    """
    force_length = np.maximum(0.0, max_force * (1.0 + e - MIN_LENGTH) / (1.0 - MIN_LENGTH))
    force_velocity = np.maximum(0.0, 1.0 + np.minimum(e_rate, 0.0) / MAX_SPEED)
    return force_length * force_velocity


@vectorize(cache=True)
def passive_force(e, e_rate, max_force):
    """Force of the parallel element, f_P (Eq. 1), N."""
    spring = STIFFNESS_PER_FORCE * max_force
    return np.maximum(0.0, spring * (np.exp(EXPONENT * e) - 1.0) + DAMPING_PER_STIFFNESS * spring * e_rate)


@vectorize(cache=True)
def force(activation, e, e_rate, max_force):
    """Total tension f = a F_l F_v + f_P, N, never negative."""
    return activation * active_force(e, e_rate, max_force) + passive_force(e, e_rate, max_force)


@vectorize(cache=True)
def stiffness(activation, e, e_rate, max_force):
    """Slope of :func:`force` in strain, df/de, N."""
    speed = np.maximum(0.0, 1.0 + np.minimum(e_rate, 0.0) / MAX_SPEED)
    active = max_force / (1.0 - MIN_LENGTH) if e > MIN_LENGTH - 1.0 else 0.0
    stretched = passive_force(e, e_rate, max_force) > 0.0
    spring = STIFFNESS_PER_FORCE * EXPONENT * max_force * np.exp(EXPONENT * e)
    return activation * active * speed + (spring if stretched else 0.0)


@vectorize(cache=True)
def damping(activation, e, e_rate, max_force):
    """Slope of :func:`force` in strain rate, df/de', N s."""
    shortening = -MAX_SPEED < e_rate < 0.0
    force_length = np.maximum(0.0, max_force * (1.0 + e - MIN_LENGTH) / (1.0 - MIN_LENGTH))
    active = force_length / MAX_SPEED if shortening else 0.0
    stretched = passive_force(e, e_rate, max_force) > 0.0
    viscous = DAMPING_PER_STIFFNESS * STIFFNESS_PER_FORCE * max_force
    return activation * active + (viscous if stretched else 0.0)


def passive_energy(e, max_force, slack_length):
    """Energy stored in the parallel element's spring at strain ``e``, J (zero when slack)."""
    e = np.maximum(e, 0.0)
    spring = STIFFNESS_PER_FORCE * max_force * slack_length
    return spring * ((np.exp(EXPONENT * e) - 1.0) / EXPONENT - e)
