"""Bags: MCAP files with messages of ROS 2, written and read without an installed ROS 2.

ROS 2's tools, Foxglove and PlotJuggler open these files. Each module has one part:

definitions: the definitions of the message types, as text
messages: the contents of messages, from poses, velocities and distances
writer: a bag that stays readable after a crash
reader: the messages of a bag, by topic
"""
