"""The MuJoCo simulator: a physics with masses, forces, contacts, and solids that move when pushed.

- `entry`: checks that the system is Linux, then starts `cli`; `cli`: the program `palaestra-mujoco`
- `physics`: moves the bodies of a world, and casts the rays of sensors
- `model`: builds MuJoCo's model from robots and shapes
- `base_model`: the parts of the model that do not depend on obstacles
- `geoms`: makes geoms from shapes, and sets which geoms may touch
- `friction`: sets the friction between materials
- `links`: parts of robots on joints, and doors
- `body`: the base of a robot that drives
- `free_bodies`: dynamic solids
- `library`: imports MuJoCo
- `rays`: the distances that sensor beams travel until they meet a boundingObject
- `lidar_rays`: the distances that lidar beams travel until they meet a visible shape
- `camera`, `renderer`: the images of cameras
- `visual_model`: a separate model of the visible shapes
- `gl_context`, `pixels`: the OpenGL context, and the conversion of its pixels
- `video`: writes the file of a movie
- `batched`: many copies of one world in one process
- `mjcf`: simulates worlds in MuJoCo's own format; it uses few of the modules above

All simulators share `scene`, which has the worlds and devices, and `ros_controller`, which has the interface
of Webots' `ros` controller.
"""
