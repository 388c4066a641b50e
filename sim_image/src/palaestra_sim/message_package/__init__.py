"""The ROS package webots_ros, generated from the definitions of the interface.

ROS's own tools and programs with `import webots_ros.srv` need this package. Simulators, sidecars and trainers
do not need it.

- `files`: generates the text of every file of the package
- `package_writer`: writes the package into a folder, atomically
- `cli`: the program `palaestra-webots-ros`
"""
