"""MuJoCo under the scene: masses, forces, contacts, and loose things that move when they are pushed.

- `cli`: `palaestra-mujoco`
- `physics`: the bodies and obstacles of a world
- `model`: from robots and shapes to MuJoCo's model
- `geoms`: from shapes to parts of a model, and what they touch
- `friction`: between materials
- `links`: parts of robots on joints, and doors
- `body`: a robot that drives
- `free_bodies`: a thing that moves when it is pushed
- `library`: MuJoCo itself
- `rays`: how far the beams of sensors travel until a boundingObject
- `lidar_rays`: how far those of lidars travel until a shape
- `camera`, `renderer`: what cameras see
- `visual_model`: from visible shapes to a model of their own
- `gl_context`, `pixels`: OpenGL
- `video`: the file of a movie
- `mjcf`: worlds in MuJoCo's own format, beside all of these

Worlds, devices and the interface are those of all simulators: `scene` and `front`.
"""
