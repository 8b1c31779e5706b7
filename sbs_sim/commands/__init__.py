"""Executables that need no running node: they print tables and write files. None of them imports ROS."""
