"""The ROS package webots_ros, made from the definitions of the interface.

ROS's own tools and a program's `import webots_ros.srv` need it; simulators, sidecars and trainers do not.

- `files`: every file of the package, as text
- `package_writer`: the package in a folder, written atomically
- `cli`: `palaestra-webots-ros`
"""
