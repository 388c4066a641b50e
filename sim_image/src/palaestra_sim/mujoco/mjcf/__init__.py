"""Worlds in MJCF: MuJoCo simulates the model unchanged, and `ros_controller` serves its robot.

- `loader`: loads a file as a simulation, and reports its mistakes
- `model`: the compiled model, and its state between two steps
- `motors`: actuators as motors
- `sensors`: sensors and cameras as devices
- `generic_devices`: sensors and actuators for which Webots has no device
- `camera`: the images of cameras
- `robot`: the robot with all devices
- `tree`: bodies, joints and devices as nodes
- `body_frame`: the frames of bodies
- `motion`: the motion of bodies
- `appearance`: what a viewer sees of a model
- `states`: saved states of bodies
- `simulation`: the Backend for `ros_controller`
"""
