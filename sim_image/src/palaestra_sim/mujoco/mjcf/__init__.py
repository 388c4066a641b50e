"""Worlds in MJCF: MuJoCo simulates the model unchanged, and `ros_controller` serves its robot.

- `loader`: loads a file as a simulation, and reports the mistakes in the file
- `model`: the compiled model and its current state
- `motors`: actuators as motors of Webots
- `sensors`: sensors and cameras as devices of Webots
- `generic_devices`: sensors and actuators for which Webots has no device
- `camera`: renders the images of cameras
- `robot`: names the devices of the robot
- `tree`: bodies, joints and devices as nodes
- `body_frame`: the frames of bodies
- `motion`: velocities of bodies and forces on them
- `appearance`: the visible shapes and poses, for viewers
- `states`: saved states of bodies
- `simulation`: implements the Backend of `ros_controller`
"""
