"""A ROS master without ROS: where nodes find each other, and the parameters that they share.

- `names`: names of ROS, relative to a node or not
- `registrations`: which node publishes, subscribes and serves what
- `parameters`: the tree of parameters
- `arguments`: the checks of the arguments of calls
- `api`: the calls of the Master API and the Parameter Server API, and the updates that they cause
- `updates`: sends these updates to the nodes
- `serving`: the master on a port
- `cli`: the program `palaestra-ros-master`
- `__main__`: the same for `python -m`

The first five are pure: no thread, socket or clock. Responses are those of rosmaster, which a contract test
compares, except that no caller can shut this master down.
Source: http://wiki.ros.org/ROS/Master_API and http://wiki.ros.org/ROS/Parameter%20Server%20API
"""
