"""XML-RPC as ROS 1 uses it, between peers that are not trusted.

- `documents`: requests and responses, as bytes; pure
- `server`: one port that answers calls
- `client`: one call, with a deadline
"""
