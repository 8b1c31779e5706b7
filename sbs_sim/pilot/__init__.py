"""Who flies the aircraft: controllers and their design, and what turns sticks into controls. Without ROS."""
