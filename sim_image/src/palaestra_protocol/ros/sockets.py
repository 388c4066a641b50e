"""The socket options of both ends of a ROS connection."""

import socket

# For `socket.setsockopt`. Small messages are sent at once. BBR, the default of many machines, is off: its
# model of the path, and a timer for each connection, cost more than they gain for a few bytes.
OPTIONS = (
    (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1),
    (socket.IPPROTO_TCP, socket.TCP_CONGESTION, b"reno"),
)

# To be read at first: what a step needs is shorter, and Python has blocks of up to 512 bytes at hand, which
# all connections use in turn. The rest of a longer one comes with the next read.
FIRST_BYTES = 448
