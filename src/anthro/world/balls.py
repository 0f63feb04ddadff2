"""Balls in free fall that bounce off surfaces and off the body, which bears the blow.

A bounce is an impulse along the normal, without friction on the body and without spin: with e the restitution, u the
speed of approach, m the ball's mass and g the slopes of the touched point along the normal in the body's velocities,

    p = (1 + e) u / (1/m + g M^-1 g^T),    ball: dv = p n / m,    body: dv = -M^-1 g^T p

so that u turns into -e u and the kinetic energy falls by (1 - e^2) u^2 / (1/m + g M^-1 g^T) / 2, never rises. Muscles
and stops meet the body's new velocity in the next step. Slopes stand still and slow a ball along them, too. Balls do
not meet each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from anthro.body.impact import jolt, point_jacobian, response
from anthro.body.simulator import Simulator
from anthro.errors import UserError
from anthro.world.capsules import Capsule, Capsules
from anthro.world.collision import contact, first_meeting, fly, nearest
from anthro.world.surfaces import Slope

GRAVITY = (0.0, 0.0, -9.81)  # m/s^2
# Balls leave with no less, if they came with as much: one at rest trembles, by 0.03 mm, where it would sink.
REST_SPEED = 0.025  # m/s
MOST = 16  # bounces of a step, after which balls fly on


@dataclass(frozen=True)
class Ball:
    """A ball's radius in m, mass in kg, and restitution on the body.

    Raises
    ------
    UserError
        Radius or mass is not positive, or restitution not of [0, 1].
    """

    radius: float = 0.05
    mass: float = 0.15
    restitution: float = 0.6

    def __post_init__(self):
        if not (0.0 < self.radius < np.inf and 0.0 < self.mass < np.inf and 0.0 <= self.restitution <= 1.0):
            raise UserError(f"ball: radius and mass must be positive and restitution of [0, 1], got {self}")


class Hit(NamedTuple):
    """A ball's bounce.

    Attributes
    ----------
    time : s.  ball : its place among the balls.  what : the capsule or slope that it met.
    limb, bone : of the capsule; empty for a slope.
    point : (3,) m, where they touched.  impulse : (3,) N s on the ball.  speed : m/s of approach.
    """

    time: float
    ball: int
    what: str
    limb: str
    bone: str
    point: np.ndarray
    impulse: np.ndarray
    speed: float


class Balls:
    """n balls in the world of a body, or of surfaces alone.

    Parameters
    ----------
    balls : what they are; none is in play before it is thrown.
    simulator : of the body that they meet, None for none.
    surfaces : what else they meet.
    capsules : what the body is covered with; those of the table when None.

    Attributes
    ----------
    position : (n, 3) m, NaN for those not in play.  velocity : (n, 3) m/s.
    hits : all bounces so far, those of balls at rest left out.

    Raises
    ------
    UserError
        There are no balls, or the body has no bone that a capsule covers.
    """

    def __init__(
        self,
        balls: Sequence[Ball],
        simulator: Simulator | None = None,
        surfaces: Sequence[Slope] = (),
        capsules: list[Capsule] | None = None,
    ):
        if not balls:
            raise UserError("balls: there are none")
        self.balls, self.surfaces, self.simulator = tuple(balls), tuple(surfaces), simulator
        self.capsules = None if simulator is None else Capsules(simulator.body, capsules)
        self.position, self.velocity = np.full((len(balls), 3), np.nan), np.zeros((len(balls), 3))
        self.hits: list[Hit] = []
        self.time = 0.0 if simulator is None else simulator.time
        self._playing = np.zeros(len(balls), bool)
        self._clock = np.zeros(len(balls))
        self._radius = np.array([ball.radius for ball in balls])
        self._gravity = np.array(GRAVITY)
        self._flat = (
            np.array([slope.centre for slope in surfaces], float).reshape(-1, 3),
            np.array([slope.axes for slope in surfaces], float).reshape(-1, 3, 3),
            np.array([slope.half_size for slope in surfaces], float).reshape(-1, 2),
        )
        round_ = self.capsules
        self._round = (np.zeros((0, 2, 3)), np.zeros((0, 2, 3))) if round_ is None else (round_.ends, round_.speeds)
        self._thickness = np.zeros(0) if round_ is None else round_.radius

    def throw(self, ball: int, position, velocity=(0.0, 0.0, 0.0)) -> None:
        """Put a ball into play at a position (3,) m with a velocity (3,) m/s.

        Raises
        ------
        UserError
            There is no such ball, or a number is not finite.
        """
        if not 0 <= ball < len(self.balls):
            raise UserError(f"there is no ball {ball} among {len(self.balls)}")
        for vector in (position, velocity):
            if np.shape(vector) != (3,) or not np.isfinite(vector).all():
                raise UserError(f"ball {ball}: position and velocity must be three finite numbers each")
        self.position[ball], self.velocity[ball], self._playing[ball] = position, velocity, True

    def remove(self, ball: int) -> None:
        """Take a ball out of play."""
        self.position[ball], self.velocity[ball], self._playing[ball] = np.nan, 0.0, False

    def follow(self) -> list[Hit]:
        """Catch up with the simulator, at most one step; the new hits.

        Raises
        ------
        UserError
            The simulator's time is earlier, or later by more than a step.
        """
        seconds = self.simulator.time - self.time
        if not -1e-9 < seconds < 1.01 * self.simulator.step_seconds:
            raise UserError(f"balls at {self.time:.3f} s cannot follow a body at {self.simulator.time:.3f} s")
        if not self._playing.any():
            self.time = self.simulator.time
            return []
        self.capsules.refresh(self.simulator)
        return self.advance(seconds)

    def advance(self, seconds: float) -> list[Hit]:
        """Let all balls fly and bounce for some time in which capsules move evenly to where they are; the new hits."""
        first = len(self.hits)
        self._clock[:] = 0.0
        state = self.position, self.velocity, self._clock
        for _ in range(MOST):
            ball, shape, time = first_meeting(
                *(*state, self._radius, self._playing, self._gravity, seconds),
                *(*self._round, self._thickness, *self._flat),
            )
            if ball < 0:
                break
            fly(self.position[ball], self.velocity[ball], self._clock[ball], self._gravity, time)
            self._clock[ball] = time
            self._bounce(ball, shape, time, seconds - time)
        for ball in np.flatnonzero(self._playing):
            fly(self.position[ball], self.velocity[ball], self._clock[ball], self._gravity, seconds)
        self.time += seconds
        return self.hits[first:]

    def _bounce(self, ball: int, shape: int, time: float, left: float) -> None:
        near, motion, normal = np.zeros((3, 3))
        position, velocity = self.position[ball], self.velocity[ball]
        nearest(position, left, shape, *self._round, *self._flat, near, motion)
        _, speed = contact(position, velocity, near, motion, normal)
        count = len(self._thickness)
        if shape < count:
            row, reach = self.capsules.rows[shape], self._thickness[shape]
            impulse = self._strike(ball, row.bone, near + left * motion, normal, speed, left)
            names = row.capsule, row.limb, row.bone
        else:
            slope, reach = self.surfaces[shape - count], 0.0
            impulse = self.balls[ball].mass * _rebound(slope, velocity, normal, speed)
            names = slope.name, "", ""
        velocity += impulse / self.balls[ball].mass
        if speed > REST_SPEED:
            self.hits.append(Hit(self.time + time, ball, *names, near + reach * normal, impulse, speed))

    def _strike(self, ball: int, bone: str, point, normal, speed: float, left: float) -> np.ndarray:
        """Impulse (3,) N s on the ball, the body struck against it ``left`` s before the present."""
        slopes = normal @ point_jacobian(self.simulator, bone, point)
        answer = response(self.simulator, slopes)
        mass = 1.0 / (1.0 / self.balls[ball].mass + slopes @ answer)
        impulse = _turned(self.balls[ball].restitution, speed) * mass
        jolt(self.simulator, -impulse * answer, left)
        self.capsules.refresh(self.simulator)
        return impulse * normal


def _turned(restitution: float, speed: float) -> float:
    """By how much a bounce changes the speed of approach, m/s."""
    return speed + max(restitution * speed, min(speed, REST_SPEED))


def _rebound(slope: Slope, velocity, normal, speed: float) -> np.ndarray:
    """Velocity change (3,) m/s of a ball on a slope; Coulomb's friction takes its slip, or a part of it."""
    turned = _turned(slope.restitution, speed)
    slip = velocity + speed * normal
    slipping = np.linalg.norm(slip)
    held = min(slope.friction * turned, slipping) / max(slipping, 1e-12)
    return turned * normal - held * slip
