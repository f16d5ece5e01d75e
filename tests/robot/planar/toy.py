"""A second robot, from a description and a model file alone: other lengths, masses, names and order of parts.

Half the human's size, with two contact radii and hip motors with inertia and damping. The file lists the left leg
first, motors from the ankle up and contact pairs heel first, so that nothing is where the human has it.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from biped.base.files import folder as models

_LEG = """
      <body name="{side}Femur" pos="0.01 0 -0.15">
        <joint name="q_{side}1" damping="0.02" armature="{armature}"/>
        <inertial pos="0.004 0 -0.1" mass="{femur}" diaginertia="0.012 0.012 0.002"/>
        <body name="{side}Tibia" pos="0 0 -0.24">
          <joint name="q_{side}2" range="-2.4 0"/>
          <inertial pos="0 0 -0.09" mass="1.1" diaginertia="0.006 0.006 0.001"/>
          <body name="{side}Sole" pos="0 0 -0.23">
            <joint name="q_{side}3" damping="0.01"/>
            <inertial pos="0.03 0 -0.02" mass="0.4" diaginertia="0.001 0.001 0.001"/>
            <geom name="{side}Ball" class="contact" pos="0.11 0 -0.04"/>
            <geom name="{side}Calx" class="contact" pos="-0.04 0 -0.04"/>
            <site name="{side}Ball" pos="0.11 0 -0.04"/>
            <site name="{side}Calx" pos="-0.04 0 -0.04"/>
          </body>
        </body>
      </body>"""

MODEL = f"""
<mujoco model="toy">
  <compiler angle="radian" autolimits="true"/>
  <option integrator="Euler" solver="Newton" cone="elliptic" impratio="10" tolerance="1e-10" jacobian="dense">
    <flag midphase="disable" island="disable" autoreset="disable"/>
  </option>
  <default>
    <joint type="hinge" axis="0 -1 0"/>
    <geom contype="0" conaffinity="0" mass="0"/>
    <default class="contact"><geom type="sphere" size="2e-6"/></default>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 0.05"/>
    <body name="trunk">
      <joint name="px" type="slide" axis="1 0 0"/>
      <joint name="pz" type="slide" axis="0 0 1"/>
      <joint name="py"/>
      <inertial pos="0 0 0" mass="11" diaginertia="0.3 0.25 0.1"/>
{_LEG.format(side="L", armature=0.004, femur=2.0)}
{_LEG.format(side="R", armature=0.003, femur=2.2)}
    </body>
  </worldbody>
  <contact>
    <pair name="RCalx" geom1="floor" geom2="RCalx"/>
    <pair name="RBall" geom1="floor" geom2="RBall"/>
    <pair name="LCalx" geom1="floor" geom2="LCalx"/>
    <pair name="LBall" geom1="floor" geom2="LBall"/>
  </contact>
  <actuator>
    <motor name="mL3" joint="q_L3"/>
    <motor name="mL2" joint="q_L2"/>
    <motor name="mL1" joint="q_L1"/>
    <motor name="mR3" joint="q_R3"/>
    <motor name="mR2" joint="q_R2"/>
    <motor name="mR1" joint="q_R1"/>
  </actuator>
  <custom><text name="flat" data="RBall RCalx LBall LCalx"/></custom>
  <keyframe>
    <key name="flat" qpos="0 0.66 -0.03   -0.2 -0.02 0.25   0.22 -0.05 -0.14"/>
  </keyframe>
</mujoco>
"""

DESCRIPTION = """
description = "A toy of half the human's size"

[base]
link = "trunk"
joints = ["px", "pz", "py"]

[[leg]]
name = "starboard"
links = ["RFemur", "RTibia", "RSole"]
joints = ["q_R1", "q_R2", "q_R3"]
actuators = ["mR1", "mR2", "mR3"]
points = ["RBall", "RCalx"]
stops = ["q_R2"]

[[leg]]
name = "port"
links = ["LFemur", "LTibia", "LSole"]
joints = ["q_L1", "q_L2", "q_L3"]
actuators = ["mL1", "mL2", "mL3"]
points = ["LBall", "LCalx"]
stops = ["q_L2"]

[contact]
ground = "floor"
radius = 2e-6

[walked]
distance = 0.1
speed = 0.15

[shown]
eye = [0.15, -1.4, 0.6]
target = [0.08, 0.0, 0.43]

[scenario.actuation]
release_force = 30.0
torque_limit = 40.0
"""


GAIT = """
k_d1 = 50.0
k_d2 = [90.0, 9.0, 9.0, 0.0]
k_d3 = [4.0, 4.0, 0.0, 4.0]
k_d4 = [2.5, 2.5, 0.6, 0.6]
b_d1 = 4.0
b_d2 = [20.0, 0.1, 0.1, 0.0]
b_d3 = [0.4, 0.4, 0.1, 0.4]
b_d4 = [1.2, 1.2, 0.1, 0.1]
theta_b = 87.5
theta_l = [68.0, 122.0, 122.0, 122.0]
theta_a = [0.0, 0.0, 10.0, 0.0]
"""
"""The published normal gait with springs and dampers of its size."""


def make(folder: Path) -> Path:
    """Writes the toy's model file, description and gait; returns the model file."""
    (folder / "gait.toml").write_text(GAIT, encoding="utf-8")
    model = folder / "toy.xml"
    model.write_text(MODEL, encoding="utf-8")
    model.with_suffix(".toml").write_text(DESCRIPTION, encoding="utf-8")
    return model


def shuffled_human(folder: Path) -> Path:
    """The human with every part it can have in another order: left leg, motors and contact pairs first to last."""
    tree = ElementTree.parse(models("models") / "human.xml")
    root = tree.getroot()
    torso = root.find("worldbody/body")
    assert torso is not None
    right, _ = torso.findall("body")
    torso.remove(right)
    torso.append(right)
    for name in ("contact", "actuator"):
        parts = root.find(name)
        assert parts is not None
        parts[:] = list(parts)[::-1]
    for key in root.iter("key"):
        q = key.attrib["qpos"].split()
        key.attrib["qpos"] = " ".join([*q[:3], *q[6:], *q[3:6]])
    tree.write(folder / "shuffled.xml")
    return folder / "shuffled.xml"
