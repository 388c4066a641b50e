"""The nodes of a loaded world, and their creation from files.

- `scene_node`: one node: its current fields, its frame, the nodes inside it
- `scope`: `DEF`, `USE` and `IS`, by file
- `expansions`: PROTOs with templates, for the values of their instances
- `instantiate`: creates nodes from files, and expands PROTOs
- `types`: the base types of Webots, with their numbers
"""
