"""ROS 1 for trainer and simulator, without ROS; all modules except `sockets` are pure.

- `tcpros`: connection headers and frames, as bytes
- `syntax`: the parser for the text of a message: its fields and constants
- `definitions`: the types of the interface, as text and parsed
- `digests`: the md5 sums and the full texts that peers exchange
- `fixed`: messages of fixed size, as numbers for one struct
- `variable`: messages with strings and lists, section by section
- `codec`: encodes and decodes the values of any message
- `rostypes`: the types of the interface, each with its digest and its codecs
- `sockets`: the socket options of both ends
"""
