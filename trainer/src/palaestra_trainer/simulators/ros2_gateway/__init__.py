"""A robot of a simulator in training, as topics of ROS 2; the gateway only reads.

Time, poses and joints come from the description of a world that simulators compute for viewers, because one
response has them all from the same step. In a run, the gateway reads the description from the sidecar, as
`palaestra view` does. So it calls no service of the training, and all viewers of a simulator share one
response. If only a ROS master is given, the gateway calls the services `palaestra/scene` and
`palaestra/scene_state`, which have the same data.

The description has no readings of sensors. The gateway reads them from topics of ROS 1, and only from topics
that another node reads already: an additional subscriber could make a simulator render pictures. A simulator
sends each subscriber a message for each step, which may be thousands a second. So the gateway connects for
one message, and then disconnects.

- `messages`: the contents of messages, from the data of a simulator
- `simulators`: where the simulators are: in a run, or at a ROS master
- `glances`: single messages of the topics of ROS 1 that a training reads
- `publishing`: the publishers of ROS 2
- `gateway`: the loop that reads a robot and publishes it
"""
