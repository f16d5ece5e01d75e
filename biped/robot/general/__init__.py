"""Robots of any kind: what a model file and its description say of one, and the model that MuJoCo steps.

A robot is its base, which moves freely in space or in the plane, two feet with contact points, and actuators on joints.
Coordinates, velocities and their order are MuJoCo's of the file.
"""
