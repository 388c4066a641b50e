"""Worlds in MJCF: MuJoCo simulates the model as it is, and the front answers for its robot.

- `loader`: from a file to a simulation, with its mistakes
- `model`: the compiled model, and its state between two steps
- `motors`: actuators as motors
- `sensors`: sensors and cameras as devices
- `generic_devices`: sensors and actuators that Webots has no device for
- `camera`: what cameras see
- `robot`: the robot with all devices
- `tree`: bodies, joints and devices as nodes
- `body_frame`: where bodies are
- `motion`: how bodies move
- `states`: saved states of bodies
- `simulation`: the Backend of the front
"""
