"""Still pictures of a posed body as in an atlas: ivory bones, red bellies, white tendons."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from anthro.body import Body
from anthro.errors import UserError
from anthro.render.camera import Camera, view_direction
from anthro.render.mesh import Mesh, join, linear_rgb, move, resample, tube
from anthro.render.parts import Part
from anthro.render.raytrace import Studio, render
from anthro.render.scene import BONE_COLOUR, RADIUS_SHARE, SPECIFIC_TENSION, geom_mesh, mesh_geoms, muscle_paths

BELLY_COLOUR, TENDON_COLOUR, LIGAMENT_COLOUR = "#B03A30", "#F1EBDD", "#8FA6B8"
PROXIMAL_TENDON = 0.12  # share of a muscle's tendon that lies at its origin
WIDEST = 0.16  # of a belly: radius over length
CARTILAGE_RADIUS, LIGAMENT_RADIUS = 0.0045, 0.0020
# Springs that stand for contact, or for a cartilage's bending, are no bands to be seen.
STAND_INS = ("_bend_", "scapulothoracic_", "_sling_")
FOV_DEG = 10.0
WHITE = linear_rgb("#FFFFFF")


@dataclass(frozen=True)
class View:
    """Where a picture is taken from; angles as in `anthro.render.camera.view_direction`."""

    title: str
    azimuth_deg: float
    elevation_deg: float = 0.0


FRONT, RIGHT, BACK = View("front", 0.0), View("right side", -90.0), View("back", 180.0)


class Anatomy:
    """All that can be drawn of a body at one pose.

    Parameters
    ----------
    body : Body
    qpos : ndarray (nq,), optional
        The neutral posture if it is left out.

    Attributes
    ----------
    bones : dict of str to Mesh
        Of each bone, in the world.
    """

    def __init__(self, body: Body, qpos: np.ndarray | None = None) -> None:
        model = body.model
        data = mujoco.MjData(model)
        if qpos is not None:
            data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)
        self.body = body
        self.bones = {
            model.geom(geom).name: move(
                geom_mesh(model, geom, BONE_COLOUR), data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
            )
            for geom in mesh_geoms(model)
        }
        self._paths = muscle_paths(model, data)

    def muscles(self, names: Iterable[str] | None = None) -> list[Mesh]:
        """Spindles of the named muscles, of all if none are named."""
        chosen = set(self.body.muscle_names if names is None else names)
        area = self.body.max_force / SPECIFIC_TENSION
        return [
            spindle(self._paths[i], area[i], self.body.slack_length[i])
            for i, name in enumerate(self.body.muscle_names)
            if name in chosen
        ]

    def bones_without(self, roots: Iterable[str]) -> dict[str, Mesh]:
        """The bones that neither are one of `roots` nor hang on one, by name."""
        model, hidden = self.body.model, {self.body.model.body(root).id for root in roots}
        for body in range(model.nbody):
            if model.body_parentid[body] in hidden:
                hidden.add(body)
        return {name: mesh for name, mesh in self.bones.items() if model.body(name).id not in hidden}

    def ligaments(self, ending: str = "") -> list[Mesh]:
        """Tubes of the ligaments whose names end so and, thicker, of the ribs' cartilage."""
        paths = self._paths[self.body.muscle_count :]
        tubes = []
        for name, path in zip(self.body.ligament_names, paths, strict=True):
            if not name.endswith(ending) or any(word in name for word in STAND_INS):
                continue
            radius = CARTILAGE_RADIUS if "chondral" in name or "cartilage" in name else LIGAMENT_RADIUS
            smooth = resample(path, 0.008)
            tubes.append(tube(smooth, np.full(len(smooth), radius), linear_rgb(LIGAMENT_COLOUR)))
        return tubes

    def points(self, names: Iterable[str]) -> np.ndarray:
        """Vertices (k, 3), m, of the named bones, to frame a picture by.

        Raises
        ------
        UserError
            The body lacks one of them.
        """
        names = list(names)
        missing = [name for name in names if name not in self.bones]
        if missing:
            raise UserError(f"{self.body.name}: no bone {missing[0]}")
        return np.concatenate([self.bones[name].vertices for name in names])


def spindle(path: np.ndarray, area: float, fiber_length: float) -> Mesh:
    """A muscle: a red belly as long as its fibers, white tendons at both ends.

    Parameters
    ----------
    path : ndarray (k, 3)
        m, from origin to insertion.
    area : float
        Physiological cross-section, m^2: the belly's radius goes with its root.
    fiber_length : float
        m.

    Returns
    -------
    Mesh
    """
    smooth = resample(path, 0.005)
    steps = np.linalg.norm(np.diff(smooth, axis=0), axis=1)
    length = steps.sum()
    along = np.concatenate([[0], np.cumsum(steps)]) / length
    # Pennate bellies are longer than their fibers, and most of a tendon lies towards the insertion.
    share = np.clip(1.4 * fiber_length / length, 0.4, 0.92)
    middle = share / 2 + PROXIMAL_TENDON * (1 - share)
    belly = np.cos(np.pi * np.clip((along - middle) / share, -0.5, 0.5))
    widest = min(RADIUS_SHARE * np.sqrt(area / np.pi), WIDEST * length)
    tendon = min(np.clip(0.22 * widest, 0.0008, 0.0025), widest)
    mesh = tube(smooth, tendon + (widest - tendon) * belly**1.3, WHITE, sides=10)
    redness = np.clip(2.2 * (belly[1:] + belly[:-1]) / 2, 0, 1)[:, None]
    colours = (1 - redness) * linear_rgb(TENDON_COLOUR) + redness * linear_rgb(BELLY_COLOUR)
    return replace(mesh, colours=np.repeat(colours, len(mesh.faces) // len(colours), axis=0))


def assemble(meshes: Sequence[Mesh]) -> Part:
    """One part of many meshes that shade each other, to be seen in several views."""
    return Part(replace(join(meshes), gloss=0.12)).bake()


def width_of(points: np.ndarray, view: View, height: int, margin: float) -> int:
    """Pixels that points (k, 3) take across a picture whose height they fill."""
    right = np.cross(view_direction(view.azimuth_deg, view.elevation_deg), [0.0, 0.0, 1.0])
    across, up = points @ right / np.linalg.norm(right), points[:, 2]
    # The nearer half of a thing looms larger than its middle.
    return int(np.ceil((1.04 * np.ptp(across) / np.ptp(up) * (1 - 2 * margin) + 2 * margin) * height))


def picture(part: Part, points: np.ndarray, view: View, width: int, height: int, margin: float = 0.02) -> np.ndarray:
    """A picture on white, lit from above the left of whoever looks at it.

    Parameters
    ----------
    part : Part
    points : ndarray (k, 3)
        m, kept in the picture.
    view : View
    width, height : int
        Pixels.
    margin : float
        Share of the picture left free at every edge.

    Returns
    -------
    ndarray (height, width, 3) uint8
    """
    camera = Camera.framing(points, view.azimuth_deg, view.elevation_deg, width, height, FOV_DEG, margin)
    right, up, forward = camera.axes
    key = -forward - 0.6 * right + 0.8 * up
    studio = Studio(key, key_rays=5, key_spread_deg=4.0, key=0.62, sky=0.66, backdrop_top=WHITE, backdrop_horizon=WHITE)
    return render([part], camera, studio)
