"""The cockpit: a page in the browser that draws a flight, live or from a log. Nothing here knows of ROS."""
