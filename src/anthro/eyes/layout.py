"""Where the photoreceptors of an eye lie: a function for each pattern, which is drawn anew for each eye.

A receptor is told by the ray that it receives, as a unit vector in the eye's frame (x along the gaze, y left, z up),
and by its place on the retina: seen from behind the eye, to the right and up, in degrees from the fovea. The pinhole
turns the picture upside down: what is at the lower right of the world lies at the upper left of the retina.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from anthro.errors import UserError
from anthro.eyes.eye import SIDES
from anthro.render.parts import GOLDEN_ANGLE
from anthro.streams import stream

MARGIN = 1.001  # of a squared radius, for what rounding does to rays that graze
FIELD_DEG = 167.5  # whole field of view of an eye (Nakada 2018, Sec. 6.1.1)
NOISE_VARIANCE = 0.0025  # Nakada 2018, Sec. 6.1.2
ANGLES, RINGS = 90, 40  # Nakada 2018, Eq. 2
RING_STEP = 0.1  # of the logarithm of a ring's radius: rho counts tenths
SKETCHING_ANGLES, SKETCHING_RINGS = 144, 69  # inferred: the factors of 9,936 nearest to the shape of 90 x 40
RETINA_MM_PER_DEG = 0.3  # of the human eye, rounded, of use near the fovea
# Cones a mm^2 (thousands) of human retinas at distances (mm) from the fovea, nasal, temporal, superior and inferior:
# the means of eight eyes of Curcio, Sloan, Kalina, Hendrickson 1990, J Comp Neurol 292:497-523, Fig. 6, as digitized
# in the repository rjonnal/cone_density.
CONES_AT_MM = (0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 14.0, 18.0)
CONES = (
    (196, 115, 73, 53, 36, 26, 21, 12.4, 8.7, 7.1, 6.3, 5.5, 4.9, 4.8),
    (196, 121, 79, 58, 38, 29, 21, 11.6, 9.0, 5.7, 4.8, 3.9, 3.4, 3.4),
    (198, 106, 66, 47, 28, 21, 16, 10.1, 7.6, 5.3, 4.7, 4.3, 3.9, 3.9),
    (198, 108, 69, 51, 33, 24, 17, 10.4, 7.6, 5.5, 4.8, 4.1, 3.7, 3.9),
)


@dataclass(frozen=True)
class Layout:
    """Photoreceptors of one eye.

    Parameters
    ----------
    name : str
        Its key in `LAYOUTS`.
    directions : ndarray (n, 3)
        Of the rays that the receptors receive, out into the world: unit, in the eye's frame.
    binary : bool
        Whether a receptor tells black or white, and not red, green and blue.
    """

    name: str
    directions: np.ndarray
    binary: bool = False

    @property
    def count(self) -> int:
        """Number of receptors."""
        return len(self.directions)

    @property
    def width(self) -> int:
        """Length of the eye's optic nerve vector."""
        return self.count * (1 if self.binary else 3)

    @property
    def eccentricity(self) -> np.ndarray:
        """Angles (n,) between the rays and the gaze, rad."""
        return np.arctan2(np.hypot(self.directions[:, 1], self.directions[:, 2]), self.directions[:, 0])

    @property
    def retina_deg(self) -> np.ndarray:
        """Places (n, 2) on the retina, seen from behind: to the right and up, degrees from the fovea."""
        # The pinhole turns left into right and up into down.
        across = np.stack([self.directions[:, 1], -self.directions[:, 2]], axis=1)
        size = np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
        return np.rad2deg(self.eccentricity)[:, None] * across / size

    def near(self, point: np.ndarray, radius: float) -> Layout:
        """Those receptors whose rays pass a point (3,) by less than a radius, m, or by hardly more.

        The point is seen from the pinhole, in the eye's frame.
        """
        along = self.directions @ point
        aside = point @ point - along * along
        return replace(self, directions=self.directions[(along > 0) & (aside < MARGIN * radius**2)])


def log_polar(rng: np.random.Generator, angles: int = ANGLES, rings: int = RINGS) -> Layout:
    """The foveated retina of Nakada 2018, Eq. 2: d = e^rho (cos alpha, sin alpha) + noise.

    Taken literally, with rho from 1 to 40, the outermost ring would lie 8e16 times as far out as the innermost one.
    Read here: rho counts tenths (for other numbers of rings, steps that span the same 4), and the ring's radius is
    e^rho - 1, the inverse of Schwartz's retino-cortical map log(z + 1) (1977), which the paper cites: without the
    shift the innermost ring would lie at 1.7 degrees and a foveated ball in a hole. Radii are degrees from the gaze,
    scaled so that the outermost ring lies on the rim of the field, half of 167.5 degrees. So rings lie 0.16 degrees
    apart at the fovea, 8 at the rim. The noise, of variance 0.0025, is added in Eq. 2's own units: 0.05 of them are
    0.08 degrees.

    Parameters
    ----------
    rng : numpy.random.Generator
    angles, rings : int
        Directions and radii of the grid.

    Returns
    -------
    Layout
        ``angles * rings`` receptors, ring by ring from the fovea outwards.
    """
    rho = RING_STEP * RINGS * np.arange(1, rings + 1) / rings
    alpha = 2 * np.pi * np.arange(angles) / angles
    radius = np.repeat(np.expm1(rho), angles)
    turn = np.tile(alpha, rings)
    return Layout("log_polar", _noisy(radius, turn, rng))


def uniform(rng: np.random.Generator, count: int = ANGLES * RINGS) -> Layout:
    """As many receptors as `log_polar` has, as dense everywhere in the same field; with its noise."""
    return Layout("uniform", _sunflower(np.ones_like, count, rng))


def sketching(rng: np.random.Generator) -> Layout:
    """The retina of Zhou 2021, Sec. 6: 9,936 receptors, noisy log-polar, black or white.

    The grid's shape is not printed; 144 x 69 is inferred.
    """
    grid = log_polar(rng, SKETCHING_ANGLES, SKETCHING_RINGS)
    return Layout("sketching", grid.directions, binary=True)


def cone_density(rng: np.random.Generator, count: int = ANGLES * RINGS) -> Layout:
    """As many receptors as `log_polar` has, as dense in proportion as the cones of human retinas; with its noise.

    The mean of four meridians (`CONES`), interpolated in the logarithm; beyond 18 mm, at the last value. Millimetres
    become degrees at 0.3 mm a degree, and density a mm^2 one of solid angle (both estimated for the periphery).
    """
    at = np.deg2rad(np.array(CONES_AT_MM) / RETINA_MM_PER_DEG)
    mean = np.log(np.mean(CONES, axis=0))
    return Layout("cone_density", _sunflower(lambda angle: np.exp(np.interp(angle, at, mean)), count, rng))


LAYOUTS: dict[str, Callable[[np.random.Generator], Layout]] = {
    "log_polar": log_polar,
    "uniform": uniform,
    "sketching": sketching,
    "cone_density": cone_density,
}


def layout(name: str, side: str, seed: int) -> Layout:
    """Receptors of the ``left`` or ``right`` eye of a run.

    Raises
    ------
    UserError
        For an unknown pattern or side, or a negative seed.
    """
    if name not in LAYOUTS:
        raise UserError(f"unknown retina {name!r}; known: {', '.join(LAYOUTS)}")
    if side not in SIDES:
        raise UserError(f"unknown side {side!r}; known: {', '.join(SIDES)}")
    return LAYOUTS[name](stream(seed, f"eyes.retina.{name}.{side}"))


def rays_at(angle: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Unit directions (n, 3) at angles (n,) from the gaze, turned (n,) about it from up to the left; rad."""
    flat = np.sin(angle)
    return np.stack([np.cos(angle), flat * np.sin(turn), flat * np.cos(turn)], axis=1)


def _noisy(radius: np.ndarray, turn: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Directions (n, 3) of receptors at radii (n,) in units of Eq. 2, the rim at that of the outermost ring."""
    rim = np.expm1(RING_STEP * RINGS)
    place = radius[:, None] * np.stack([np.sin(turn), np.cos(turn)], axis=1)
    place = place + rng.normal(0.0, np.sqrt(NOISE_VARIANCE), place.shape)
    size = np.minimum(np.hypot(*place.T) / rim, 1.0)
    return rays_at(size * np.deg2rad(FIELD_DEG / 2), np.arctan2(*place.T))


def _sunflower(density: Callable[[np.ndarray], np.ndarray], count: int, rng: np.random.Generator) -> np.ndarray:
    """Directions (count, 3) whose number in a solid angle goes with a density of the angle from the gaze, rad."""
    rim = np.deg2rad(FIELD_DEG / 2)
    # Finer towards the fovea, where densities change most.
    angle = rim * np.linspace(0, 1, 20001) ** 3
    middle = (angle[1:] + angle[:-1]) / 2
    share = np.concatenate([[0.0], np.cumsum(density(middle) * np.sin(middle) * np.diff(angle))])
    placed = np.interp((np.arange(count) + 0.5) / count, share / share[-1], angle)
    return _noisy(placed / rim * np.expm1(RING_STEP * RINGS), GOLDEN_ANGLE * np.arange(count), rng)
