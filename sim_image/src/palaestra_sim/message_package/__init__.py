"""The ROS package webots_ros, generated from the definitions of the interface.

ROS's own tools and programs with `import webots_ros.srv` need it; simulators, sidecars and trainers do not.

- `files`: every file of the package, as text
- `package_writer`: writes the package into a folder, atomically
- `cli`: `palaestra-webots-ros`
"""
