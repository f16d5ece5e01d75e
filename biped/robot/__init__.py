"""A robot, as its model file and its description say it.

A robot is its base, which moves freely in space or in the plane, two feet with contact points, and actuators on joints.
Coordinates, velocities and their order are MuJoCo's of the file; those of seven links in a plane (`planar/`) have a
canonical order of their own.
"""
