"""The protocol of ROS 1 for trainer and simulator; no ROS package is needed.

All modules except `sockets` are pure.

- `tcpros`: connection headers and frames, as bytes
- `syntax`: the parser for the text of a message: its fields and constants
- `definitions`: the text and the parsed form of each type of the interface
- `digests`: the md5 sums and the full texts that peers exchange
- `fixed`: encodes messages of fixed size with one struct each
- `variable`: encodes messages with strings and lists, section by section
- `codec`: encodes and decodes any message, with `fixed` or `variable`
- `rostypes`: the types of the interface, each with its md5 sum and its codecs
- `topic_headers`: the headers that a publisher and a subscriber exchange
- `sockets`: the socket options of both ends of a connection
- `shutdown`: reads the name of the node that the master wants to end from the reason of a shutdown
"""
