"""Many copies of one world in one process, stepped by `mujoco.batch`, for `palaestra-mujoco --batch N`.

- `server`: the socket on which a trainer requests steps and resets
- `world`: the interface of a batched world, and the readings of a step
- `rows`: MuJoCo's batch of one model: steps, failed rows, a saved state
- `scene_batch`: a world with a robot on wheels
- `scene_checks`: lists the parts of a world that `scene_batch` cannot simulate
- `clearance`: finds the rows whose robot cannot touch anything
- `program`: loads the world and serves its copies until a signal
- `wheels`: the bases of all rows, as arrays
- `scene_sensors`: the readings of all rows, as arrays
- `shapes`: the objects on the floor, for the trainer
- `model_batch`: a world that is a model of MuJoCo
- `trigonometry`: functions of arrays that return the same bits as Python's `math`

A *row* is one copy. The *single simulation* is the simulation of one copy, without this package. Every row
has the same values as the single simulation, bit for bit, because both use the same arithmetic.
"""
