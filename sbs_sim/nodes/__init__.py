"""ROS 2 nodes: thin shells around the library. Nothing outside this folder imports ROS."""
