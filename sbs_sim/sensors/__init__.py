"""Sensors on board: what they measure of a flight, with their errors, rates and delays. Without ROS."""
