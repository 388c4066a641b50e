"""A ROS master without ROS, by which nodes find each other and share parameters.

- `names`: global, private and relative names of ROS
- `registrations`: the topics and services of each node
- `parameters`: the tree of parameters
- `arguments`: the checks of the arguments of calls
- `api`: the methods of the Master API and the Parameter Server API, and the updates that they cause
- `updates`: the sender of these updates to the nodes
- `serving`: the server that listens on a port
- `cli`: the program `palaestra-ros-master`
- `__main__`: the same program for `python -m`

The first five modules are pure: they use no thread, socket or clock. The responses are those of rosmaster, as
a contract test checks, except that a caller cannot shut this master down. Source:
http://wiki.ros.org/ROS/Master_API and http://wiki.ros.org/ROS/Parameter%20Server%20API
"""
