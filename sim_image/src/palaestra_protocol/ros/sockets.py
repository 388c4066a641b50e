"""The socket options of both ends of a ROS connection."""

import socket

# For `socket.setsockopt`. Small messages are sent at once. BBR, the default congestion control of many
# machines, is off: its model of the path and its timer per connection cost more than they gain for a few
# bytes.
OPTIONS = (
    (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1),
    (socket.IPPROTO_TCP, socket.TCP_CONGESTION, b"reno"),
)

# Size of the first read. What a step needs is shorter, and Python keeps blocks of up to 512 bytes at hand,
# which all connections reuse in turn. The rest of a longer message comes with the next read.
FIRST_BYTES = 448
