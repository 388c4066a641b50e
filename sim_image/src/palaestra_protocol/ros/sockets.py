"""The socket options of both ends of a ROS connection."""

import socket

# The arguments of `socket.setsockopt`. TCP_NODELAY sends small messages at once. Reno replaces BBR, the
# default congestion control of many machines: for messages of a few bytes, BBR's model of the path and its
# timers cost more time than they save.
OPTIONS = (
    (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1),
    (socket.IPPROTO_TCP, socket.TCP_CONGESTION, b"reno"),
)

# Size of the first read in bytes. The messages of a step are shorter than this. Python caches memory blocks
# of up to 512 bytes, so all connections reuse the same block in turn. The next read returns the rest of a
# longer message.
FIRST_BYTES = 448
