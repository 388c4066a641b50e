"""The nodes of a world that is loaded, and how they grow from files.

- `scene_node`: one node: fields as they are now, place, the nodes inside
- `scope`: `DEF`, `USE` and `IS`, by file
- `instantiate`: from files to nodes; PROTOs are expanded here
- `types`: the types of Webots that are no PROTOs, with their numbers
"""
