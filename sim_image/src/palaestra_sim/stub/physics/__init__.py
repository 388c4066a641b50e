"""Motion and sight on the floor: wheels, contacts and rays, as functions of numbers.

Knows no world file, node or service.
"""
