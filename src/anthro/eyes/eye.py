"""The two eyes in the head: where they sit, how far and how fast they turn.

Angles are those of Nakada 2018, Sec. 6.1.1, in the head's frame (x forward, y left, z up): theta turns the gaze to the
left about the vertical axis, phi lifts it about the horizontal one; at theta = phi = 0 the eyes look straight ahead.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from anthro.errors import UserError

RADIUS = 0.012  # m (Nakada 2018, Sec. 6.1.1)
PUPILS_APART = 0.0634  # m: mean of adults (Dodgson 2004, Proc SPIE 5291:36-46)
# Of an eye's centre from the head's frame, m: the middle of the orbit of the skull's mesh, whose rims are 0.031 and
# 0.06 high; the cornea's apex 16 mm before the lateral rim at 0.074 (usual of an exophthalmometer; estimated).
FORWARD, UPWARD = 0.078, 0.045
# How far an eye turns: means of 261 people (Lee, Kim, Shin, Hwang, Lim 2019, Eye 33:1145-1151), degrees.
ADDUCTION_DEG, ABDUCTION_DEG, ELEVATION_DEG, DEPRESSION_DEG = 44.9, 44.2, 27.9, 47.1
TOP_SPEED = float(np.deg2rad(900))  # rad/s (Nakada 2018, Sec. 6.2.1)
SIDES = ("left", "right")


@dataclass(frozen=True)
class Eye:
    """One eye.

    Attributes
    ----------
    side : str
        ``left`` or ``right``.
    """

    side: str

    def __post_init__(self) -> None:
        if self.side not in SIDES:
            raise UserError(f"unknown side {self.side!r}; known: {', '.join(SIDES)}")

    @property
    def centre(self) -> np.ndarray:
        """Centre of rotation (3,), m, in the head's frame."""
        aside = PUPILS_APART / 2
        return np.array([FORWARD, aside if self.side == "left" else -aside, UPWARD])

    @property
    def limits(self) -> np.ndarray:
        """Least and greatest theta, least and greatest phi as rows (2, 2), rad."""
        left, right = ABDUCTION_DEG, ADDUCTION_DEG  # of the left eye
        if self.side == "right":
            left, right = right, left
        return np.deg2rad([[-right, left], [-DEPRESSION_DEG, ELEVATION_DEG]])

    def within(self, angles: np.ndarray) -> np.ndarray:
        """Angles theta, phi (..., 2), rad, moved into the eye's limits."""
        return np.clip(angles, *self.limits.T)

    def rotation(self, angles: np.ndarray) -> np.ndarray:
        """From the eye's frame to the head's (3, 3) at angles theta, phi (2,), rad: first phi, then theta."""
        theta, phi = angles
        (ct, st), (cp, sp) = (np.cos(theta), np.sin(theta)), (np.cos(phi), np.sin(phi))
        return np.array([[ct * cp, -st, -ct * sp], [st * cp, ct, -st * sp], [sp, 0.0, cp]])

    def pupil(self, angles: np.ndarray) -> np.ndarray:
        """The pinhole (3,), m, in the head's frame."""
        return self.centre + RADIUS * self.rotation(angles)[:, 0]

    def angles_to(self, point: np.ndarray) -> np.ndarray:
        """Angles theta, phi (..., 2), rad, at which the gaze goes through points (..., 3), m, of the head's frame.

        The pinhole lies on the line of gaze, so its place does not matter. Limits are not heeded.
        """
        x, y, z = np.moveaxis(np.asarray(point, float) - self.centre, -1, 0)
        return np.stack([np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))], axis=-1)


def towards(angles: np.ndarray, goal: np.ndarray, most: float) -> np.ndarray:
    """Angles (2,), rad, on the straight way to a goal (2,), no further than `most`, rad."""
    way = np.asarray(goal, float) - angles
    length = np.linalg.norm(way)
    return np.array(goal, float) if length <= most else angles + way * (most / length)


@dataclass(frozen=True)
class EyeState:
    """Where an eye is, and the saccade that it makes.

    Parameters
    ----------
    angles : ndarray (2,)
        theta, phi, rad.
    origin, goal : ndarray (2,), optional
        Of the saccade, rad; None between saccades.
    elapsed, duration : float
        Of the saccade, s.
    """

    angles: np.ndarray
    origin: np.ndarray | None = None
    goal: np.ndarray | None = None
    elapsed: float = 0.0
    duration: float = 0.0


@dataclass(frozen=True)
class PaperMover:
    """Eyes as in the papers: at most 900 degrees a second towards what is commanded.

    Theta and phi are limited together; the gaze itself never turns faster than they do.
    """

    top_speed: float = TOP_SPEED

    def step(self, eye: Eye, state: EyeState, command: np.ndarray, seconds: float) -> EyeState:
        """The eye after a control step.

        Parameters
        ----------
        eye : Eye
        state : EyeState
        command : ndarray (2,)
            Angles theta, phi where the eye ought to look, rad.
        seconds : float
            Length of the step.
        """
        return EyeState(towards(state.angles, eye.within(_finite(command)), self.top_speed * seconds))


@dataclass(frozen=True)
class MainSequenceMover:
    """Eyes whose saccades saturate: the larger one's peak speed grows ever less with its amplitude.

    Peak speed ``top_speed (1 - exp(-amplitude / scale))`` is the main sequence (Bahill, Clark, Stark 1975, Math
    Biosci 24:191-204); both constants are fitted here to 213, 352 and 455 degrees a second at 5, 15 and 30 degrees
    (Hopf et al. 2018, PLoS ONE 13:e0204008), in units of their standard deviations. A saccade is ballistic and goes
    as a minimum-jerk movement, whose peak speed is 15/8 of the mean. Smaller errors are followed smoothly, no faster
    than people can (90 degrees a second; Meyer, Lasker, Robinson 1985, Vision Res 25:561-563).
    """

    top_speed: float = float(np.deg2rad(442.3))
    scale: float = float(np.deg2rad(7.91))
    threshold: float = float(np.deg2rad(1.0))
    pursuit_speed: float = float(np.deg2rad(90.0))

    def peak_speed(self, amplitude: float) -> float:
        """Of a saccade of that amplitude, rad: rad/s."""
        return self.top_speed * -np.expm1(-amplitude / self.scale)

    def step(self, eye: Eye, state: EyeState, command: np.ndarray, seconds: float) -> EyeState:
        """The eye after a control step; arguments as in `PaperMover.step`. A saccade under way heeds no command."""
        command = eye.within(_finite(command))
        if state.goal is None:
            way = command - state.angles
            amplitude = float(np.linalg.norm(way))
            if amplitude <= self.threshold:
                return EyeState(towards(state.angles, command, self.pursuit_speed * seconds))
            duration = 15 / 8 * amplitude / self.peak_speed(amplitude)
            state = EyeState(state.angles, state.angles, command, 0.0, duration)
        elapsed = state.elapsed + seconds
        if elapsed >= state.duration:
            return EyeState(state.goal)
        s = elapsed / state.duration
        share = s**3 * (10 - 15 * s + 6 * s * s)
        return replace(state, angles=state.origin + share * (state.goal - state.origin), elapsed=elapsed)


MOVERS = {"paper": PaperMover, "main_sequence": MainSequenceMover}


def mover(name: str) -> PaperMover | MainSequenceMover:
    """The way eyes move: ``paper`` or ``main_sequence``; UserError for another one."""
    if name not in MOVERS:
        raise UserError(f"unknown eye movement {name!r}; known: {', '.join(MOVERS)}")
    return MOVERS[name]()


def _finite(command: np.ndarray) -> np.ndarray:
    command = np.asarray(command, float)
    if command.shape != (2,) or not np.isfinite(command).all():
        raise UserError(f"an eye is commanded by two finite angles, not {command}")
    return command
