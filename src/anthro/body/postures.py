"""Random postures that a body can take: its driven joints drawn, its passive ones settled.

A bone with three angles does not reach the ends of all at once: their shares of the half ranges are
kept inside the unit ball.

Ribs, sternum and patellae are passive joints (the q_p of Zhou et al. 2021, Appendix B, Eq. 3): no
posture holds them apart from what ligaments and joint springs allow. They are settled where the
energy of those is least.
"""

from __future__ import annotations

import mujoco
import numpy as np

PASSIVE = ("rib", "sternum_", "patella_")
# Spinal joints that bend together: each such chain is drawn bent as a whole in a part of the postures.
CHAINS, LEVELS = ("_flexion", "_lateral", "_axial"), "CTL"
SETTLING_STEPS = 4
SPREAD = 0.25  # of the half range, by which joints of a chain that is bent as a whole differ


class PostureSampler:
    """Draws postures of one compiled model.

    Parameters
    ----------
    model : mujoco.MjModel
        Joints with stiffness about zero, and tendons of which those with stiffness are ligaments.
    """

    def __init__(self, model: mujoco.MjModel):
        self.model, self._data = model, mujoco.MjData(model)
        joints = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE)
        names = [model.joint(int(j)).name for j in joints]
        self._qpos, self._dof = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        self.low, self.high = model.jnt_range[joints].T
        self._chains = [
            np.array([i for i, n in enumerate(names) if ending in n and n[0] in LEVELS], int) for ending in CHAINS
        ]
        bones = model.jnt_bodyid[joints]
        self._balls = [
            np.flatnonzero(bones == bone) for bone in np.unique(bones) if np.count_nonzero(bones == bone) == 3
        ]
        self._passive = np.array([i for i, n in enumerate(names) if n.startswith(PASSIVE)], int)
        self._stiffness = model.jnt_stiffness[joints][self._passive]
        self._ligaments = np.flatnonzero(model.tendon_stiffness > 0.0)
        self._spring = model.tendon_stiffness[self._ligaments]
        spans = [slice(model.ten_J_rowadr[t], model.ten_J_rowadr[t] + model.ten_J_rownnz[t]) for t in self._ligaments]
        self._entry = np.concatenate([np.arange(s.start, s.stop) for s in spans] or [np.empty(0)]).astype(int)
        self._row = np.repeat(np.arange(len(spans)), model.ten_J_rownnz[self._ligaments])

    def draw(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Postures (count, m) rad: uniform in the ranges, half of them with bent chains."""
        middle, half = 0.5 * (self.high + self.low), 0.5 * (self.high - self.low)
        share = rng.uniform(-1.0, 1.0, (count, len(middle)))
        for chain in self._chains:
            bent = rng.random(count) < 0.5
            whole = rng.uniform(-1.0, 1.0, (count, 1)) + SPREAD * rng.uniform(-1.0, 1.0, (count, len(chain)))
            share[np.ix_(bent, chain)] = np.clip(whole[bent], -1.0, 1.0)
        for ball in self._balls:
            share[:, ball] /= np.maximum(1.0, np.linalg.norm(share[:, ball], axis=1, keepdims=True))
        postures = middle + half * share
        if len(self._passive):
            postures[:, self._passive] = 0.0
            for posture in postures:
                self.settle(posture)
        return postures

    def settle(self, posture: np.ndarray) -> None:
        """Move the passive joints of ``posture`` (m,) rad, in place, to rest under ligaments and springs."""
        if not len(self._passive):
            return
        columns, low, high = self._dof[self._passive], self.low[self._passive], self.high[self._passive]
        for _ in range(SETTLING_STEPS):
            stretch, slopes = self._stretch(posture)
            slopes = slopes[:, columns]
            angle = posture[self._passive]
            gradient = slopes.T @ (self._spring * stretch) + self._stiffness * angle
            curvature = (slopes.T * self._spring) @ slopes + np.diag(self._stiffness + 1e-3)
            posture[self._passive] = np.clip(angle - np.linalg.solve(curvature, gradient), low, high)

    def lengths(self, posture: np.ndarray) -> np.ndarray:
        """Path lengths (t,) m of all tendons at a posture (m,) rad."""
        data = self._data
        data.qpos[self._qpos] = posture
        mujoco.mj_kinematics(self.model, data)
        mujoco.mj_comPos(self.model, data)
        mujoco.mj_tendon(self.model, data)
        return data.ten_length.copy()

    def _stretch(self, posture) -> tuple[np.ndarray, np.ndarray]:
        """How far each ligament is from rest, m, and its slopes dl/dq (k, nv)."""
        model, data, rows = self.model, self._data, self._ligaments
        low, high = model.tendon_lengthspring[rows].T
        length = self.lengths(posture)[rows]
        slopes = np.zeros((len(rows), model.nv))
        slopes[self._row, model.ten_J_colind[self._entry]] = data.ten_J[self._entry]
        stretch = length - np.clip(length, low, high)
        slopes[stretch == 0.0] = 0.0
        return stretch, slopes
