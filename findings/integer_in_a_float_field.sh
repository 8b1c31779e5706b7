#!/usr/bin/env bash
# ROS 2 Jazzy, Python: an integer in a float64 field goes out as the number of its digits.
#
# Since Jazzy the setters of Python messages check no types unless ROS_PYTHON_CHECK_FIELDS=1 is set. The conversion to C reads
# the object as a Python float without a look at what it is: where a float has its value, an int of CPython 3.11 has its
# length in digits of 30 bits, with the sign of the number. Vector3(x=5) is sent as 5e-324, x=-1 as NaN, x=2**40 as 1e-323;
# no exception, no warning, and the sender's own copy still shows 5. A commanded velocity of 5 m/s becomes one of nothing.
#
# Seen with ros-jazzy-rclpy 7.1.6, ros-jazzy-geometry-msgs 5.3.6 and ros-rmw-fastrtps-cpp 8.4.3 in Python 3.11: the output
# below; exit status 0 while it is so. Another Python lays out its integers otherwise, and sends other numbers.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf -- "$folder"' EXIT
python3.11 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    ros-jazzy-rclpy==7.1.6 ros-jazzy-geometry-msgs==5.3.6 ros-rmw-fastrtps-cpp==8.4.3
cat >"$folder/send.py" <<'PYTHON'
from geometry_msgs.msg import Vector3
from rclpy.serialization import deserialize_message, serialize_message

for value in (5.0, 5, -1, 2**40):
    try:
        sent = Vector3(x=value)
    except AssertionError as error:
        print(f"{value!r}: {str(error).split(',')[0]}")
        continue
    received = deserialize_message(serialize_message(sent), Vector3)
    print(f"{value!r}: the sender has {sent.x!r}, the receiver {received.x!r}")
PYTHON
unset ROS_PYTHON_CHECK_FIELDS
{
    "$folder/venv/bin/python" "$folder/send.py"
    echo 'ROS_PYTHON_CHECK_FIELDS=1'
    ROS_PYTHON_CHECK_FIELDS=1 "$folder/venv/bin/python" "$folder/send.py"
} | tee "$folder/seen"
diff - "$folder/seen" <<'SEEN'
5.0: the sender has 5.0, the receiver 5.0
5: the sender has 5, the receiver 5e-324
-1: the sender has -1, the receiver nan
1099511627776: the sender has 1099511627776, the receiver 1e-323
ROS_PYTHON_CHECK_FIELDS=1
5.0: the sender has 5.0, the receiver 5.0
5: The 'x' field must be of type 'float'
-1: The 'x' field must be of type 'float'
1099511627776: The 'x' field must be of type 'float'
SEEN
