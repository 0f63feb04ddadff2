"""A small seated body of boxes with a head, a left arm and a right leg, and rollouts of it, as a run holds them."""

import mujoco
import numpy as np

from anthro.files import write_shard

MODEL = """
<mujoco>
  <compiler autolimits="false"/>
  <asset>
    <mesh name="box" vertex="-.02 -.02 0  .02 -.02 0  .02 .02 0  -.02 .02 0
                             -.02 -.02 -.3  .02 -.02 -.3  .02 .02 -.3  -.02 .02 -.3"/>
  </asset>
  <worldbody>
    <body name="sacrum" pos="0 0 .5">
      {root}
      <geom type="mesh" mesh="box" pos="0 0 .1" mass="1"/>
      <body name="hip_bone_r" pos="0 -.1 -.05"><geom type="mesh" mesh="box" pos="0 0 .25" mass="1"/></body>
      <body name="T1" pos="0 0 .5">
        <geom type="mesh" mesh="box" mass="1"/>
        <site name="trunk" pos=".1 .1 .1"/>
        <site name="nape" pos="-.05 0 0"/>
        <body name="cranium" pos="0 0 .1">
          <joint name="C1_axial" axis="0 0 1"/>
          <geom type="mesh" mesh="box" pos="0 0 .35" mass="1"/>
          <site name="occiput" pos="-.05 0 .1"/>
          <site name="effector_head" pos="0 0 .2"/>
        </body>
        <body name="humerus_l" pos="0 .2 0">
          <joint name="shoulder_flexion_l" axis="0 -1 0"/>
          <geom type="mesh" mesh="box" mass="1"/>
          <site name="arm" pos=".05 0 -.2"/>
        </body>
      </body>
      <body name="femur_r" pos="0 -.1 0">
        <joint name="hip_flexion_r" axis="0 -1 0"/>
        <geom type="mesh" mesh="box" pos=".3 0 0" euler="0 90 0" mass="1"/>
        <geom type="mesh" mesh="box" pos=".3 0 -.1" mass="1"/>
        <site name="thigh" pos=".2 0 .05"/>
      </body>
    </body>
  </worldbody>
  <tendon>
    <spatial name="deltoid_l"><site site="trunk"/><site site="arm"/></spatial>
    <spatial name="splenius_l"><site site="nape"/><site site="occiput"/></spatial>
    <spatial name="psoas_r"><site site="trunk"/><site site="thigh"/></spatial>
  </tendon>
</mujoco>
"""
TABLES = {
    "joints": "joint,region,min,max,rest,stiffness,damping\n"
    "C1_axial,neck,-1,1,0,0,1\nshoulder_flexion_l,arm,-1,2,0,0,1\nhip_flexion_r,leg,-1,2,0,0,1\n",
    "muscles": "muscle,region,group,max_force,slack_length,tendon_length\n"
    "deltoid_l,arm,shoulder,100,0.2,0.1\nsplenius_l,neck,splenius capitis,50,0.1,0.1\npsoas_r,leg,hip,500,0.2,0.1\n",
    "ligaments": "ligament,stiffness,damping,slack_low,slack_high\n",
    "contacts": "contact,radius,surfaces\n",
}
HINGES, MUSCLES, INSTANTS = 3, 3, 120


def write_body(run, name="nakada2018", free=False):
    """Write the body, its root fixed or free, to ``run/body/name``."""
    folder = run / "body" / name
    folder.mkdir(parents=True)
    model = mujoco.MjModel.from_xml_string(MODEL.format(root='<freejoint name="root"/>' if free else ""))
    mujoco.mj_saveModel(model, str(folder / "model.mjb"))
    for table, text in TABLES.items():
        (folder / f"{table}.csv").write_text(text)


def record(run, demo="on_off", body="nakada2018", limbs="left_arm", props="", attrs=None, **changes):
    """Write a rollout of 12 s: on, off from 3 to 7 s, on; columns may be changed, added or, by None, left out."""
    time = np.arange(INSTANTS) * 0.1
    on = (time < 3) | (time >= 7)
    height = np.where(on, 1.4, 1.4 - np.clip(time - 3, 0, 0.5))
    height[time >= 7] = 0.9 + np.clip(time[time >= 7] - 7, 0, 0.5)
    count = len(limbs.split())
    effector = np.zeros((INSTANTS, count, 3))
    effector[..., 2] = height[:, None]
    columns = {
        "time": time,
        "qpos": np.linspace(0, 1, INSTANTS)[:, None].repeat(HINGES, axis=1),
        "activation": on[:, None] * np.full((INSTANTS, MUSCLES), 0.3),
        "effector": effector,
        "target": np.full((INSTANTS, count, 3), [0.3, 0.2, 1.3]),
        "controller_on": on.astype(np.uint8),
    }
    columns.update(changes)
    columns = {name: values for name, values in columns.items() if values is not None}
    told = {"body": body, "limbs": limbs, "props": props, "seed": 7, "step_seconds": 0.1} | (attrs or {})
    write_shard(run / "demos" / demo / "rollout.h5", columns, told)


def turned(axis, degrees):
    """Quaternions (n, 4) of turns (n,) about a unit axis."""
    half = np.deg2rad(np.asarray(degrees, float)) / 2
    return np.concatenate([np.cos(half)[:, None], np.sin(half)[:, None] * np.asarray(axis)], axis=1)
