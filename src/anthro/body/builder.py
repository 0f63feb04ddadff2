"""Compose a MuJoCo model (MjSpec) from a list of parts."""

from __future__ import annotations

import mujoco
import numpy as np

from anthro.body.parts import BodyPlan, Part
from anthro.body.source import Source
from anthro.errors import UserError

_OBJ = mujoco.mjtObj
BONE_COLOUR = (0.90, 0.87, 0.80, 1.0)
WRAP_GROUP = 4
JOINT_TYPES = {"hinge": mujoco.mjtJoint.mjJNT_HINGE}


class Builder:
    """Adds parts to one MjSpec: bones with their meshes, joints, then muscle paths."""

    def __init__(self, plan: BodyPlan):
        self.plan = plan
        self.spec = mujoco.MjSpec()
        self.spec.modelname = plan.name
        self.spec.option.timestep = 0.005
        self.spec.option.gravity = (0.0, 0.0, -9.81)
        self.spec.compiler.degree = False
        self.spec.compiler.autolimits = False
        # Limits are springs of the simulator, so that inverse dynamics sees them exactly.
        self.spec.option.disableflags = int(
            mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_ACTUATION
        )
        self._bodies = {}
        self._source_bodies = {}
        self._sources = {}

    def add(self, part: Part) -> None:
        """Add one part; its parents must have been added before."""
        source = self._sources.setdefault(part.source_model, Source.load(part.source_model))
        for bone in part.bones:
            self._add_bone(source, bone)
        for joint in part.joints:
            self._bone(joint.bone, joint.joint).add_joint(
                name=joint.joint,
                type=self._joint_type(joint),
                axis=joint.axis,
                limited=mujoco.mjtLimited.mjLIMITED_TRUE,
                range=np.deg2rad([joint.min_deg, joint.max_deg]),
                damping=[joint.damping_Nms_rad, 0.0, 0.0],
                armature=1e-4,
            )
        for muscle in part.muscles:
            self._add_path(source, muscle.muscle, muscle.source_tendon)

    @staticmethod
    def _joint_type(joint) -> mujoco.mjtJoint:
        if joint.kind not in JOINT_TYPES:
            known = ", ".join(JOINT_TYPES)
            raise UserError(f"joint {joint.joint}: unknown kind {joint.kind!r}, known are {known}")
        return JOINT_TYPES[joint.kind]

    def compile(self) -> mujoco.MjModel:
        """The finished model; one tendon a muscle, in the tables' order."""
        hand = self._bone(self.plan.hand_bone, "the hand")
        hand.add_site(name="hand", pos=self.plan.hand_point_m, group=5)
        return self.spec.compile()

    def _bone(self, name: str, of: str):
        if name not in self._bodies:
            raise UserError(f"{self.plan.name}: {of} hangs on {name!r}, which is no bone before it")
        return self._bodies[name]

    def _add_bone(self, source: Source, bone) -> None:
        index = source.body(bone.source_body)
        if bone.parent == "world":
            parent, parent_index = self.spec.worldbody, None
        else:
            parent = self._bone(bone.parent, bone.bone)
            parent_index = self._source_bodies[bone.parent]
        position, quaternion = source.relative_pose(index, parent_index)
        body = parent.add_body(name=bone.bone, pos=position, quat=quaternion)
        self._bodies[bone.bone], self._source_bodies[bone.bone] = body, index
        if bone.mass_kg > 0.0:
            body.explicitinertial = True
            body.mass = bone.mass_kg
            body.ipos = source.model.body_ipos[index]
            body.iquat = source.model.body_iquat[index]
            scale = bone.mass_kg / source.model.body_mass[index]
            body.inertia = source.model.body_inertia[index] * scale
        for geom in source.mesh_geoms(index):
            self._add_mesh(source, body, bone.bone, geom)

    def _add_mesh(self, source: Source, body, name: str, geom: int) -> None:
        vertices, faces = source.mesh(geom)
        self.spec.add_mesh(
            name=name,
            uservert=np.asarray(vertices, float).ravel(),
            userface=np.asarray(faces, np.int32).ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            pos=source.model.geom_pos[geom],
            quat=source.model.geom_quat[geom],
            rgba=BONE_COLOUR,
            contype=0,
            conaffinity=0,
            mass=0.0,
            group=0,
        )

    def _owner(self, source: Source, source_body: int):
        for bone, index in self._source_bodies.items():
            if index == source_body:
                return self._bodies[bone]
        name = source.name(_OBJ.mjOBJ_BODY, source_body)
        raise UserError(f"path runs over {name}, which is no bone of {self.plan.name}")

    def _add_site(self, source: Source, name: str) -> str:
        if self.spec.site(name) is None:
            index = mujoco.mj_name2id(source.model, _OBJ.mjOBJ_SITE, name)
            owner = self._owner(source, source.model.site_bodyid[index])
            owner.add_site(name=name, pos=source.model.site_pos[index], group=WRAP_GROUP)
        return name

    def _add_wrap(self, source: Source, name: str) -> str:
        if self.spec.geom(name) is None:
            index = mujoco.mj_name2id(source.model, _OBJ.mjOBJ_GEOM, name)
            owner = self._owner(source, source.model.geom_bodyid[index])
            owner.add_geom(
                name=name,
                type=mujoco.mjtGeom(source.model.geom_type[index]),
                size=source.model.geom_size[index],
                pos=source.model.geom_pos[index],
                quat=source.model.geom_quat[index],
                contype=0,
                conaffinity=0,
                mass=0.0,
                group=WRAP_GROUP,
            )
        return name

    def _add_path(self, source: Source, name: str, source_tendon: str) -> None:
        tendon = self.spec.add_tendon(name=name)
        for element in source.path(source_tendon):
            if element.kind == "site":
                tendon.wrap_site(self._add_site(source, element.name))
            else:
                side = element.side_site
                side = self._add_site(source, side) if side else ""
                tendon.wrap_geom(self._add_wrap(source, element.name), side)


def compose(plan: BodyPlan, parts: list[Part]) -> mujoco.MjModel:
    """Compile the body that ``plan`` names from its parts, added in order."""
    builder = Builder(plan)
    for part in parts:
        builder.add(part)
    return builder.compile()
