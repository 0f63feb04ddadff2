"""Colours of muscles by group, brighter with activation, and the words that explain them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anthro.body import Body
from anthro.motor.limb import SIDES, members
from anthro.render.mesh import linear_rgb

# Of the palette for colour blind readers of Okabe and Ito (Wong 2011), sRGB.
ARM_COLOURS = {"shoulder": "#D55E00", "elbow": "#0072B2", "forearm": "#CC79A7", "wrist": "#009E73"}
# The legs are coloured like the joints of the arms above them.
LEG_COLOURS = {"hip": "#D55E00", "knee": "#0072B2", "ankle": "#009E73"}
# Trunk and neck: by where a muscle lies, so by how it bends the spine.
TRUNK_COLOURS = {"front": "#56B4E9", "side": "#CC79A7", "back": "#E69F00"}
PALE = "#B9A79B"  # a muscle that nobody commands
FRONT = (
    "rectus abdominis",
    "external oblique",
    "internal oblique",
    "transversus abdominis",
    "psoas major",
    "diaphragm",
    "pectoralis minor",
    "subclavius",
    "hyoid muscles",
    "sternocleidomastoid",
    "vertical longus colli",
    "oblique longus colli",
    "ascending longus colli",
    "longus capitis",
    "rectus capitis anterior",
)
SIDE = (
    "anterior scalene",
    "middle scalene",
    "posterior scalene",
    "levator scapula",
    "external intercostal",
    "internal intercostal",
    "serratus anterior",
)


def drawn_group(group: str) -> str:
    """The group as the palette knows it: a joint of a limb, or a side of trunk and neck."""
    if group in ARM_COLOURS | LEG_COLOURS | TRUNK_COLOURS:
        return group
    return "front" if group in FRONT else "side" if group in SIDE else "back"


def group_colour(group: str) -> str:
    """Colour ``#rrggbb`` of any group of muscles, always the same one."""
    return (ARM_COLOURS | LEG_COLOURS | TRUNK_COLOURS)[drawn_group(group)]


def shades(groups: Sequence[str], activation: np.ndarray, led: np.ndarray | None = None) -> tuple:
    """Colours (n, 3), linear RGB, and glow (n,) of muscles: their groups' hues, brighter with activation.

    Parameters
    ----------
    groups : sequence of str
        Of each of n muscles.
    activation : ndarray (n,)
        0 to 1.
    led : ndarray (n,) bool, optional
        Which of them a controller commands, all if it is left out; the others are pale at rest.
    """
    share = np.sqrt(np.clip(activation, 0.0, 1.0))[:, None]
    hues = {group: linear_rgb(group_colour(group)) for group in set(groups)}
    hue = np.array([hues[group] for group in groups]).reshape(-1, 3)
    bright = hue * (0.25 + 0.75 * share)
    if led is not None:
        pale = (1 - share) * linear_rgb(PALE) + share * hue
        bright = np.where(led[:, None], bright, pale)
    return bright, 0.5 * share[:, 0]


def limb_muscles(body: Body, limb: str) -> np.ndarray:
    """Which of a body's muscles (n,) bool are those of a limb, such as ``left_arm``, ``neck_seated`` or ``core``."""
    first, _, last = limb.partition("_")
    region, side = (last, first) if first in SIDES else (first, "both")
    chosen = np.zeros(body.muscle_count, bool)
    chosen[members(body.muscle_names, body.muscle_regions, region, side)] = True
    return chosen


def legend(limbs: Sequence[str]) -> dict[str, str]:
    """Words and their colours ``#rrggbb`` for the muscles of some limbs; groups of one colour share their words."""
    words: dict[str, list[str]] = {}
    for limb in limbs:
        for group, colour in colours_of(limb).items():
            known = words.setdefault(colour, [])
            if group not in known:
                known.append(group)
    return {"/".join(groups): colour for colour, groups in words.items()}


def colours_of(limb: str) -> dict[str, str]:
    """Groups and colours ``#rrggbb`` of one limb's muscles."""
    if limb.endswith("arm"):
        return ARM_COLOURS
    return LEG_COLOURS if limb.endswith("leg") else TRUNK_COLOURS
