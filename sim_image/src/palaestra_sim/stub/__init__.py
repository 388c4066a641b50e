"""The stub simulator: worlds, robots and the ROS interface of Webots' `ros` controller, without Webots.

simulation        time, steps, resets, without ROS
scene, physics, rays    what is read from the world, and what happens in it
tree, nodes, fields     the scene tree as a supervisor sees it
controller        the services and topics of one robot
ros               the wire
"""
