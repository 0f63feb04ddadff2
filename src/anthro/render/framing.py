"""Where the camera stands for a rollout, and which bones fill its picture."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco

NECK_BONES = (
    *(f"C{i}" for i in range(1, 8)),
    *(f"T{i}" for i in range(1, 4)),
    *(f"{bone}_{side}" for bone in ("clavicle", "scapula", "rib1", "rib2") for side in "rl"),
    *("cranium", "mandible", "hyoid"),
)
ELEVATION_DEG = 6.0
SIDE_DEG = 64.0  # the fall of an arm and its depth both show from there
PEN_DEG = 128.0  # what a pen writes is read over the shoulder of its arm


def framed_bones(model: mujoco.MjModel, limbs: Sequence[str], props: Sequence[str] = ()) -> set[int]:
    """Bodies of the model that the picture must hold.

    Parameters
    ----------
    model : mujoco.MjModel
    limbs : sequence of str
        Those that move: the neck asks for head and shoulders, the arms and the core for all above
        the legs, a leg for the whole body.
    props : sequence of str
        What it sits or lies on: a chair that reclines is seen whole.

    Returns
    -------
    set of int
        All bodies if the model has none of these.
    """
    everything = set(range(1, model.nbody))
    if "chair" in props or any(limb.endswith("leg") for limb in limbs):
        return everything
    if all(limb.startswith("neck") for limb in limbs):
        chosen = {body for body in everything if model.body(body).name in NECK_BONES}
    else:
        chosen = everything - _below(model, ("femur_r", "femur_l"))
    return chosen or everything


def _below(model: mujoco.MjModel, names: Sequence[str]) -> set[int]:
    found: set[int] = set()
    for body in range(1, model.nbody):
        if model.body(body).name in names or model.body_parentid[body] in found:
            found.add(body)
    return found


def holds_targets(limbs: Sequence[str]) -> bool:
    """Whether the picture must hold the targets too: a head only turns to its own, which may lie far."""
    return any(limb.endswith(("arm", "leg")) for limb in limbs)


def azimuth_deg(limbs: Sequence[str], writes: bool) -> float:
    """Where the camera stands, as in `anthro.render.camera.view_direction`: on the moving limbs' side."""
    left = sum(limb.startswith("left") for limb in limbs)
    right = sum(limb.startswith("right") for limb in limbs)
    if left and right:
        return -40.0
    side = 1.0 if left else -1.0
    return side * (PEN_DEG if writes else SIDE_DEG)
