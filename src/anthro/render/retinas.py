"""Beside a film frame: both retinas as they are lit, and the activations of all muscles."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw
from scipy.spatial import cKDTree

from anthro.errors import UserError
from anthro.eyes.eye import SIDES
from anthro.eyes.layout import FIELD_DEG, Layout, layout
from anthro.registry import SEATED
from anthro.render.caption import INK, PAPER, fit_font
from anthro.render.palette import group_colour, limb_muscles
from anthro.render.rollout import Rollout

SHARE = 0.36  # of a frame's width that the panels take
BETWEEN = 38  # grey about a retina
GAMMA = 2.2  # of the display
FAINT = "#E4E7EA"  # behind the bars of activations


class Retinas:
    """Panels beside the frames of a rollout that has the column ``nerve``: retinas seen from behind, and activations.

    A retina is drawn with the square root of the angle from the fovea as radius, so that the fovea can be seen; each
    pixel has the colour of the nearest receptor.

    Parameters
    ----------
    rollout : Rollout
    width, height : int
        Of the panels, pixels.

    Raises
    ------
    UserError
        The optic nerve vectors are not those of the rollout's retina.
    """

    def __init__(self, rollout: Rollout, width: int, height: int) -> None:
        self.rollout, self.width, self.height = rollout, width, height
        name = str(rollout.attrs.get("retina", "log_polar"))
        receptors = [layout(name, side, rollout.seed) for side in SIDES]
        if rollout.others["nerve"].shape[1:] != (2, receptors[0].width):
            raise UserError(f"optic nerve vectors of {rollout.others['nerve'].shape[1:]} do not fit the retina {name}")
        self._words = max(6, height // 20)
        self._side = min((width - 6) // 2, int(0.6 * height) - self._words)
        self._maps = [nearest_receptor(one, self._side) for one in receptors]
        body = rollout.body
        self._order = np.concatenate([np.flatnonzero(limb_muscles(body, limb)) for limb in SEATED])
        self._ends = np.cumsum([limb_muscles(body, limb).sum() for limb in SEATED])
        self._colours = [group_colour(body.muscle_groups[k]) for k in self._order]

    def draw(self, now: Rollout) -> np.ndarray:
        """Panels (height, width, 3) uint8 at a rollout's only instant."""
        sheet = Image.new("RGB", (self.width, self.height), PAPER)
        draw, font = ImageDraw.Draw(sheet), fit_font(2 * self._words, round(2.8 * self.width))
        gap = (self.width - 2 * self._side) // 3
        for index, (side, vector) in enumerate(zip(SIDES, now.others["nerve"][0], strict=True)):
            left = gap + index * (self._side + gap)
            sheet.paste(Image.fromarray(retina(vector, self._maps[index])), (left, self._words))
            draw.text((left + self._side / 2, self._words / 2), f"{side} retina", INK, font, anchor="mm")
        top = self._side + 2 * self._words
        draw.text((gap, top - self._words / 2), "activations", INK, font, anchor="lm")
        self._bars(draw, now.activation[0], top, font)
        return np.asarray(sheet)

    def _bars(self, draw: ImageDraw.ImageDraw, activation: np.ndarray, top: int, font) -> None:
        """A bar for each muscle, a row for each limb."""
        starts = np.concatenate([[0], self._ends[:-1]])
        rows = len(SEATED)
        tall = (self.height - top) / rows
        for row, (limb, start, end) in enumerate(zip(SEATED, starts, self._ends, strict=True)):
            base, most = top + (row + 1) * tall - 2, max(tall - self._words - 2, 1)
            left, right = 4, self.width - 4
            draw.rectangle([left, base - most, right, base], fill=FAINT)
            words = limb.removesuffix("_seated").replace("_", " ")
            draw.text((left, base - most - self._words / 2), words, INK, font, anchor="lm")
            step = (right - left) / max(end - start, 1)
            for place, muscle in enumerate(range(start, end)):
                high = most * float(np.clip(activation[self._order[muscle]], 0.0, 1.0))
                x = left + place * step
                if high >= 0.5:
                    draw.rectangle([x, base - high, x + max(step - 1, 0), base], fill=self._colours[muscle])


def nearest_receptor(receptors: Layout, side: int) -> np.ndarray:
    """Which receptor (side, side) each pixel shows; -1 outside the retina."""
    place = receptors.retina_deg
    away = np.hypot(*place.T)
    bent = place / np.maximum(np.sqrt(away), 1e-9)[:, None]
    edge = np.sqrt(FIELD_DEG / 2)
    across = edge * ((np.arange(side) + 0.5) / side * 2.0 - 1.0)
    pixels = np.stack(np.meshgrid(across, -across), axis=-1)
    index = cKDTree(bent).query(pixels.reshape(-1, 2))[1].reshape(side, side)
    return np.where(np.linalg.norm(pixels, axis=2) <= edge, index, -1)


def retina(vector: np.ndarray, receptor: np.ndarray) -> np.ndarray:
    """A picture (side, side, 3) uint8 of an optic nerve vector, bytes of linear RGB, by `nearest_receptor`."""
    colours = np.full((len(vector) // 3 + 1, 3), BETWEEN, np.uint8)
    colours[:-1] = np.rint(255 * (vector.reshape(-1, 3) / 255.0) ** (1 / GAMMA))
    return colours[receptor]
