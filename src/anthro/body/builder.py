"""Compose a MuJoCo model (MjSpec) from regions of anatomy.

Every body frame is parallel to the world in the neutral posture, its origin at the joint centre,
so that zero angles are the neutral posture and the tables' numbers need no turning.
"""

from __future__ import annotations

import mujoco
import numpy as np

from anthro.body.meshes import MeshLibrary, mirrored
from anthro.body.model import EFFECTOR
from anthro.body.parts import BodyPlan, Part
from anthro.errors import UserError

BONE_COLOUR = (0.90, 0.87, 0.80, 1.0)
BONE_GROUP, WRAP_GROUP, SITE_GROUP = 0, 4, 5
ARMATURE = 1e-4  # kg m^2: keeps the mass matrix of the smallest bones well conditioned
ROOT = "root"
GEOMETRY = {"sphere": mujoco.mjtGeom.mjGEOM_SPHERE, "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER}


class Builder:
    """Adds parts to one MjSpec: bones with their surfaces, joints, then what runs between them."""

    def __init__(self, plan: BodyPlan, meshes: MeshLibrary, absent: set[str] = frozenset()):
        self.plan, self.meshes, self._absent = plan, meshes, absent
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
        self._bodies, self._origins = {}, {}
        self.muscles, self.muscle_regions, self.ligaments, self.contacts = [], [], [], []

    def add_skeleton(self, part: Part) -> None:
        """Add one region's bones and, where they move, its joints; parents must be there."""
        for bone in part.bones:
            self._add_bone(bone)
        if part.name not in self.plan.moving:
            return
        for joint in part.joints:
            axis = np.array(joint.axis)
            self._bone(joint.bone, joint.joint).add_joint(
                name=joint.joint,
                type=mujoco.mjtJoint.mjJNT_HINGE,
                axis=axis / np.linalg.norm(axis),
                limited=mujoco.mjtLimited.mjLIMITED_TRUE,
                range=np.deg2rad([joint.min_deg, joint.max_deg]),
                stiffness=[joint.stiffness_Nm_rad, 0.0, 0.0],
                damping=[joint.damping_Nms_rad, 0.0, 0.0],
                armature=ARMATURE,
            )

    def add_muscles(self, part: Part) -> None:
        """Add one region's muscle paths, one tendon each, in the tables' order."""
        if part.name not in self.plan.muscular:
            return
        for wrap in part.wraps:
            self._add_wrap(wrap)
        for muscle in part.muscles:
            if muscle.muscle in self._absent:
                continue
            tendon = self.spec.add_tendon(name=muscle.muscle)
            for row in part.paths[muscle.muscle]:
                site = f"{row.muscle}_{row.order}"
                if row.kind == "wrap":
                    tendon.wrap_geom(row.wrap, self._side_site(site, row))
                else:
                    tendon.wrap_site(self._add_site(site, row.bone, row.point))
            self.muscles.append(muscle)
            self.muscle_regions.append(part.name)

    def add_ligaments(self, part: Part) -> None:
        """Add the region's ligaments that join bones of this body which move against each other."""
        for row in part.ligaments:
            if any(bone not in self._bodies for bone, _ in row.ends):
                continue
            ends = [self._moving_part(bone) for bone, _ in row.ends]
            if ends[0] == ends[1]:
                continue
            tendon = self.spec.add_tendon(
                name=row.ligament, stiffness=[row.stiffness_N_m, 0.0, 0.0], damping=[row.damping_Ns_m, 0.0, 0.0]
            )
            for end, (bone, point) in zip("ab", row.ends, strict=True):
                tendon.wrap_site(self._add_site(f"{row.ligament}_{end}", bone, point))
            self.ligaments.append(row)

    def add_contacts(self, part: Part) -> None:
        """Add a site for each sphere that may touch ground or seat."""
        for row in part.contacts:
            self._add_site(f"contact_{row.contact}", row.bone, row.point)
            self.contacts.append(row)

    def add_effectors(self, rows: list) -> None:
        """Add a site for each effector whose bone this body has."""
        for row in rows:
            if row.bone in self._bodies:
                self._add_site(f"{EFFECTOR}{row.effector}", row.bone, row.point)

    def compile(self) -> mujoco.MjModel:
        """The finished model: muscles' tendons first, then the ligaments' with their rest lengths."""
        model = self.spec.compile()
        first = len(self.muscles)
        rest = model.tendon_length0[first:]
        struts = np.array([row.kind == "strut" for row in self.ligaments], bool)
        low = np.where(struts, rest, 0.0)
        for row, low_end, high_end in zip(self.ligaments, low, rest, strict=True):
            self.spec.tendon(row.ligament).springlength = (low_end, high_end)
        return self.spec.compile()

    def _bone(self, name: str, of: str):
        if name not in self._bodies:
            raise UserError(f"{self.plan.name}: {of} hangs on {name!r}, which is no bone before it")
        return self._bodies[name]

    def _moving_part(self, bone: str) -> str:
        """The nearest bone up the tree that has joints, to which ``bone`` is welded."""
        body = self._bone(bone, "a ligament")
        while body.name and body.name != "world" and not body.joints:
            body = body.parent
        return body.name

    def _add_bone(self, bone) -> None:
        origin = np.array(bone.origin)
        if bone.parent == "world":
            parent, place = self.spec.worldbody, origin.copy()
            if self.plan.root_height_m is not None:
                place[2] = self.plan.root_height_m
        else:
            parent = self._bone(bone.parent, bone.bone)
            place = origin - self._origins[bone.parent]
        body = parent.add_body(name=bone.bone, pos=place)
        if bone.parent == "world" and self.plan.root_free:
            body.add_freejoint(name=ROOT)
        self._bodies[bone.bone], self._origins[bone.bone] = body, origin
        gyration = np.array(bone.gyration) ** 2
        body.explicitinertial = True
        body.mass = bone.mass_kg
        body.ipos = np.array(bone.com) - origin
        body.inertia = bone.mass_kg * gyration
        mesh = self.meshes.get(bone.mesh)
        self._add_mesh(body, bone.bone, mirrored(mesh) if bone.bone.endswith("_l") else mesh, origin)

    def _add_mesh(self, body, name: str, mesh, origin: np.ndarray) -> None:
        self.spec.add_mesh(
            name=name,
            uservert=np.asarray(mesh.vertices - origin, float).ravel(),
            userface=np.asarray(mesh.faces, np.int32).ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            rgba=BONE_COLOUR,
            contype=0,
            conaffinity=0,
            mass=0.0,
            group=BONE_GROUP,
        )

    def _add_site(self, name: str, bone: str, point) -> str:
        body = self._bone(bone, name)
        body.add_site(name=name, pos=np.array(point) - self._origins[bone], group=SITE_GROUP)
        return name

    def _side_site(self, name: str, row) -> str:
        if None in row.side_point:
            return ""
        wrap = self.spec.geom(row.wrap)
        if wrap is None:
            raise UserError(f"{self.plan.name}: {row.muscle} wraps over {row.wrap!r}, which is no wrap")
        return self._add_site(f"{name}_side", wrap.parent.name, row.side_point)

    def _add_wrap(self, wrap) -> None:
        quaternion, half_length = np.array([1.0, 0.0, 0.0, 0.0]), 0.0
        if wrap.kind == "cylinder":
            if None in (*wrap.axis, wrap.half_length_m):
                raise UserError(f"{self.plan.name}: cylinder {wrap.wrap} lacks its axis or half length")
            axis, half_length = np.array(wrap.axis), wrap.half_length_m
            mujoco.mju_quatZ2Vec(quaternion, axis / np.linalg.norm(axis))
        self._bone(wrap.bone, wrap.wrap).add_geom(
            name=wrap.wrap,
            type=GEOMETRY[wrap.kind],
            size=(wrap.radius_m, half_length, 0.0),
            pos=np.array(wrap.point) - self._origins[wrap.bone],
            quat=quaternion,
            contype=0,
            conaffinity=0,
            mass=0.0,
            group=WRAP_GROUP,
        )


def compose(
    plan: BodyPlan, parts: list[Part], meshes: MeshLibrary, absent: set[str] = frozenset(), effectors: list = ()
) -> Builder:
    """The body that ``plan`` names, from its parts in order, ready to compile."""
    builder = Builder(plan, meshes, absent)
    for part in parts:
        builder.add_skeleton(part)
    for add in (builder.add_muscles, builder.add_ligaments, builder.add_contacts):
        for part in parts:
            add(part)
    builder.add_effectors(effectors)
    return builder
