"""MuJoCo as the physics of a scene: masses, forces, contacts, and dynamic solids that move when pushed.

- `entry`: the start of `palaestra-mujoco`, which refuses a system other than Linux; `cli`: the program
- `physics`: the bodies and obstacles of a world
- `model`: builds MuJoCo's model from robots and shapes
- `geoms`: builds parts of a model from shapes, and sets which of them may touch
- `friction`: between materials
- `links`: parts of robots on joints, and doors
- `body`: a robot that drives
- `free_bodies`: dynamic solids
- `library`: MuJoCo itself
- `rays`: the distances that the beams of sensors travel to a boundingObject
- `lidar_rays`: the distances that the beams of lidars travel to a shape
- `camera`, `renderer`: the images of cameras
- `visual_model`: a separate model of the visible shapes
- `gl_context`, `pixels`: OpenGL
- `video`: the file of a movie
- `mjcf`: worlds in MuJoCo's own format, independent of the modules above

Worlds, devices and the interface are those of all simulators: `scene` and `ros_controller`.
"""
