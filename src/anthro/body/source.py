"""Read-only view of a compiled myo-sim model: frames, meshes, sites, wraps, in Anthro's world.

myo-sim faces -y with its right side at -x; Anthro faces +x with left at +y.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field

import mujoco
import myo_sim
import numpy as np

from anthro.errors import UserError

_OBJ = mujoco.mjtObj
_TURN = np.array([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])  # +90 degrees about z


@dataclass
class PathElement:
    """One element of a tendon path: a site, or a wrapping geom with an optional side site."""

    kind: str
    name: str
    side_site: str | None = None


@dataclass
class Source:
    """A compiled source model in its neutral pose."""

    model: mujoco.MjModel
    data: mujoco.MjData = field(init=False)

    def __post_init__(self):
        self.data = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, self.data)

    @classmethod
    def load(cls, name: str) -> Source:
        """Compile the named myo-sim model."""
        tell = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(lambda text: None)  # its composer warns about empty prefixes
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return cls(myo_sim.load_spec(name).compile())
        finally:
            mujoco.set_mju_user_warning(tell)

    def body(self, name: str) -> int:
        return self._id(_OBJ.mjOBJ_BODY, name)

    def _id(self, kind, name: str) -> int:
        index = mujoco.mj_name2id(self.model, kind, name)
        if index < 0:
            raise UserError(f"source model has no {kind.name.removeprefix('mjOBJ_').lower()} {name!r}")
        return index

    def name(self, kind, index: int) -> str:
        return mujoco.mj_id2name(self.model, kind, int(index)) or f"{kind.name}_{index}"

    def world_pose(self, body: int) -> tuple[np.ndarray, np.ndarray]:
        """Position (3,) m and orientation (4,) of a body in Anthro's world."""
        position, quaternion = np.empty(3), np.empty(4)
        mujoco.mju_rotVecQuat(position, self.data.xpos[body], _TURN)
        mujoco.mju_mulQuat(quaternion, _TURN, self.data.xquat[body])
        return position, quaternion

    def relative_pose(self, body: int, parent: int | None) -> tuple[np.ndarray, np.ndarray]:
        """Pose of ``body`` in ``parent``'s frame (world when None) in the neutral posture."""
        position, quaternion = self.world_pose(body)
        if parent is None:
            return position, quaternion
        origin, orientation = self.world_pose(parent)
        inverse, relative, turned = np.empty(4), np.empty(4), np.empty(3)
        mujoco.mju_negQuat(inverse, orientation)
        mujoco.mju_mulQuat(relative, inverse, quaternion)
        mujoco.mju_rotVecQuat(turned, position - origin, inverse)
        return turned, relative

    def mesh_geoms(self, body: int) -> list[int]:
        """Geoms of a body that are bone meshes."""
        start, count = self.model.body_geomadr[body], self.model.body_geomnum[body]
        kinds = self.model.geom_type
        return [g for g in range(start, start + count) if kinds[g] == mujoco.mjtGeom.mjGEOM_MESH]

    def mesh(self, geom: int) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (n, 3) m in the geom's frame and faces (k, 3) of a mesh geom."""
        mesh = self.model.geom_dataid[geom]
        v, nv = self.model.mesh_vertadr[mesh], self.model.mesh_vertnum[mesh]
        f, nf = self.model.mesh_faceadr[mesh], self.model.mesh_facenum[mesh]
        return self.model.mesh_vert[v : v + nv], self.model.mesh_face[f : f + nf]

    def path(self, tendon: str) -> list[PathElement]:
        """The tendon's path in order, by names."""
        index = self._id(_OBJ.mjOBJ_TENDON, tendon)
        start, count = self.model.tendon_adr[index], self.model.tendon_num[index]
        elements = []
        for k in range(start, start + count):
            target = self.model.wrap_objid[k]
            if self.model.wrap_type[k] == mujoco.mjtWrap.mjWRAP_SITE:
                elements.append(PathElement("site", self.name(_OBJ.mjOBJ_SITE, target)))
                continue
            side = int(self.model.wrap_prm[k])
            side_site = self.name(_OBJ.mjOBJ_SITE, side) if side >= 0 else None
            elements.append(PathElement("wrap", self.name(_OBJ.mjOBJ_GEOM, target), side_site))
        return elements
