"""ArduPilot's side of a flight: its packets, its servos, its parameters. No ROS, no sockets."""
