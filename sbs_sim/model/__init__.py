"""The flight dynamics model: pure functions on flat arrays, without files, ROS or time of day."""
