"""An MJCF model of a cart with a pole and some devices, and MuJoCo's own simulation of the cart."""

import pytest

from palaestra_sim.mujoco.mjcf.loader import load as load_mjcf
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.validation import LeaveOut

CARTPOLE = """<mujoco model="cartpole">
  <custom>
    <text name="controllerArgs" data="--name=cartpole --synchronize"/>
    <numeric name="basicTimeStep" data="10"/>
  </custom>
  <option timestep="0.002"/>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1"/>
    <body name="cart" pos="0 0 1">
      <joint name="slider" type="slide" axis="1 0 0" range="-2 2" limited="true"/>
      <geom type="box" size="0.1 0.1 0.05" mass="1"/>
      <site name="chip" pos="0 0 -0.1" quat="0 1 0 0"/>
      <camera name="eye" resolution="32 16" fovy="60"/>
      <body name="pole">
        <joint name="hinge" axis="0 1 0" damping="0.01"/>
        <geom type="capsule" fromto="0 0 0.06 0 0 0.6" size="0.03" mass="0.1" contype="0" conaffinity="0"/>
      </body>
    </body>
    <body name="ball" pos="1 1 0.5">
      <freejoint/>
      <geom name="skin" size="0.1"/>
      <site name="skin" size="0.2"/>
    </body>
    <body name="target" pos="3 0 0.5"><geom type="box" size="0.1 0.1 0.1"/></body>
  </worldbody>
  <actuator>
    {actuator}
  </actuator>
  <sensor>
    <jointpos name="cart position" joint="slider"/>
    <jointvel name="cart speed" joint="slider"/>
    <jointpos joint="hinge"/>
    <rangefinder name="down" site="chip"/>
    <gyro name="gyro" site="chip"/>
    <accelerometer name="accelerometer" site="chip"/>
    <framepos name="gps" objtype="body" objname="ball"/>
    <framequat name="imu" objtype="site" objname="chip"/>
    <touch name="bump" site="skin"/>
    {sensor}
  </sensor>
</mujoco>
"""
FORCE = '<motor name="push" joint="slider" gear="2" ctrlrange="-10 10" ctrllimited="true"/>'
VELOCITY = '<velocity name="push" joint="slider" kv="50"/>'
POSITION = '<position name="push" joint="slider" kp="500" dampratio="1" ctrlrange="-1.5 1.5"/>'


@pytest.fixture
def cartpole(tmp_path):
    """`cartpole(actuator, sensor, *changes)` writes the world with texts replaced, and returns its path."""

    def write(actuator=FORCE, sensor="", *changes):
        text = CARTPOLE.format(actuator=actuator, sensor=sensor)
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "cartpole.xml"
        path.write_text(text)
        return path

    return write


@pytest.fixture
def load(cartpole):
    """`load(...)` returns the simulation of such a world; it leaves out the node types in `leave_out`."""

    def load(*texts, leave_out=()):
        return load_mjcf(cartpole(*texts), Mode.FAST, LeaveOut(types=frozenset(leave_out)))

    return load
