"""MuJoCo under the scene: masses, forces, contacts, and loose things that move when they are pushed.

- `cli`: `palaestra-mujoco`
- `physics`: the bodies and obstacles of a world
- `model`: from robots and shapes to MuJoCo's model
- `geoms`: from shapes to parts of a model, and what they touch
- `friction`: between materials
- `links`: parts of robots on joints, and doors
- `body`: a robot that drives
- `loose`: a thing that moves when it is pushed
- `library`: MuJoCo itself
- `rays`: how far the beams of sensors travel until a boundingObject
- `sight`: how far those of lidars travel until a shape
- `eye`, `pictures`: what cameras see
- `visible`: from visible shapes to a model of their own
- `canvas`, `pixels`: OpenGL
- `film`: the file of a movie
- `mjcf`: worlds in MuJoCo's own format, beside all of these

Worlds, devices and the interface are those of all simulators: `scene` and `front`.
"""
