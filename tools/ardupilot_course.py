"""A course of ten way points that the real ArduPilot flies, and how far from it the aircraft was.

    python3 -m pip install --target /tmp/mavlink pymavlink==2.4.50
    PYTHONPATH=/tmp/mavlink ./run python tools/ardupilot_course.py --firmware ardupilot/build/sitl/bin/arducopter-heli \
        --defaults ardupilot/Tools/autotest/default_params/copter-heli.parm

Take-off to 8 m, ten way points with a stop at each, landing; in still air and in 4 m/s of wind. Outside the tests: the
firmware is built from ArduPilot's sources, by `./waf configure --board sitl` and `./waf heli`. Positions are those of
the simulation. How far ArduPilot's estimate is from the course, and how far the aircraft is from its target and from
its estimate, says what part of the error is its control and what part is its estimate; both come from its log. Load is
what else the machine does: compare the processor time that a frame takes.
"""

import argparse
import contextlib
import itertools
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import psutil

from sbs_sim.recording import read

ROOT = Path(__file__).resolve().parents[1]
BRIDGE = ROOT / "install" / "sbs_sim" / "lib" / "sbs_sim" / "ardupilot"
HOME = (-35.363262, 149.165237, 584.0)  # deg, deg, m
POINTS = [(15, 0), (15, 15), (30, 15), (30, -10), (10, -20), (-10, -20), (-10, 0), (-25, 10), (-10, 20), (0, 0)]  # m
HEIGHT, STOP, SPEED = 8.0, 2.0, 300.0  # m, s at each point, cm/s
DISTANCES = ("aircraft from course", "estimate from course", "aircraft from target", "aircraft from estimate")
AIRBORNE = 1.0  # m of height from which positions count
RATE = 400.0  # frames per second
EARTH = 6378100.0  # m, as ArduPilot has it
GUIDED, AUTO = 4, 3
INTERLOCK, COLLECTIVE = 8, 3  # channels
ESTIMATE = 8 | 16  # flags of the estimator: it knows where it is, along and across
LIMIT = 900.0  # s of wall time
UPLOADS = 10  # tries, 2 s apart: it has no room for a course before it is ready


class Pilot:
    """The ground station of the flight."""

    def __init__(self, port: int) -> None:
        from pymavlink import mavutil

        self.mav, self.names = mavutil.mavlink, {}
        self.link = mavutil.mavlink_connection(f"tcp:127.0.0.1:{port}", source_system=255, retries=60)
        self.link.wait_heartbeat(timeout=60)
        self.target = self.link.target_system, self.link.target_component
        # the state of the estimator alone: ArduPilot waits for a ground station that is slow to read
        self.link.mav.request_data_stream_send(*self.target, self.mav.MAV_DATA_STREAM_EXTRA3, 2, 1)

    def hear(self, seconds, wanted=None):
        """Messages for a while of wall time, up to one that is wanted."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            message = self.link.recv_match(blocking=True, timeout=0.3)
            if message is not None and wanted is not None and wanted(message):
                return message
        return None

    def sticks(self, interlock, collective=1500):
        """Pulses of the transmitter [us]."""
        pulses = [65535] * 18
        pulses[:4] = [1500] * 4
        pulses[INTERLOCK - 1], pulses[COLLECTIVE - 1] = interlock, collective
        self.link.mav.rc_channels_override_send(*self.target, *pulses)

    def command(self, number, *values):
        """Send a command; true if it was accepted."""
        self.link.mav.command_long_send(*self.target, number, 0, *values, *[0] * (7 - len(values)))
        found = self.hear(20, lambda one: one.get_type() == "COMMAND_ACK" and one.command == number)
        return found is not None and found.result == 0

    def mode(self, number):
        """Change the mode; true if it is flown."""
        self.link.set_mode(number)
        wanted = lambda one: one.get_type() == "HEARTBEAT" and one.custom_mode == number  # noqa: E731
        return self.hear(10, wanted) is not None

    def set(self, name, value):
        """Set a parameter."""
        self.link.mav.param_set_send(*self.target, name.encode(), value, self.mav.MAV_PARAM_TYPE_REAL32)
        self.hear(5, lambda one: one.get_type() == "PARAM_VALUE" and one.param_id == name)

    def upload(self):
        """The course."""
        navigate, up, down = (getattr(self.mav, f"MAV_CMD_NAV_{one}") for one in ("WAYPOINT", "TAKEOFF", "LAND"))
        items = [(navigate, 0.0, 0.0, 0.0, 0.0), (up, 0.0, 0.0, 0.0, HEIGHT)]
        items += [(navigate, STOP, north, east, HEIGHT) for north, east in POINTS] + [(down, 0.0, 0.0, 0.0, 0.0)]
        self.link.mav.mission_count_send(*self.target, len(items))
        kinds = ("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK")
        while True:
            asked = self.hear(10, lambda one: one.get_type() in kinds)
            if asked is None or asked.get_type() == "MISSION_ACK":
                return asked is not None and asked.type == 0
            kind, stop, north, east, height = items[asked.seq]
            latitude = HOME[0] + math.degrees(north / EARTH)
            longitude = HOME[1] + math.degrees(east / (EARTH * math.cos(math.radians(HOME[0]))))
            place = (0, 0) if kind == up else (round(latitude * 1e7), round(longitude * 1e7))
            frame = self.mav.MAV_FRAME_GLOBAL_RELATIVE_ALT if asked.seq else self.mav.MAV_FRAME_GLOBAL
            self.link.mav.mission_item_int_send(
                *(*self.target, asked.seq, frame, kind, 0, 1, stop, 0.0, 0.0, 0.0, *place, height)
            )

    def fly(self):
        """The course from arming to disarming; true if it was flown."""
        self.sticks(1000, 1000)
        if not any(self.upload() or self.hear(2) for _ in range(UPLOADS)):
            return False
        self.set("WPNAV_SPEED", SPEED)
        end = time.monotonic() + LIMIT
        while time.monotonic() < end:  # until it knows where it is
            self.sticks(1000, 1000)
            found = self.hear(2, lambda one: one.get_type() == "EKF_STATUS_REPORT")
            if found is not None and found.flags & ESTIMATE == ESTIMATE:
                break
        self.mode(GUIDED)
        while not self.command(self.mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) and time.monotonic() < end:
            self.sticks(1000, 1000)
        while not self.mode(AUTO) and time.monotonic() < end:  # not before the rotors turn at their speed
            self.sticks(2000)
        self.command(self.mav.MAV_CMD_MISSION_START)
        armed = self.mav.MAV_MODE_FLAG_SAFETY_ARMED
        while time.monotonic() < end:
            self.sticks(2000)
            beat = self.hear(0.5, lambda one: one.get_type() == "HEARTBEAT")
            if beat is not None and not beat.base_mode & armed:
                return True
        return False


def processor_time(process):
    """What a process has used until now [s]."""
    times = psutil.Process(process.pid).cpu_times()
    return times.user + times.system


def flown(options, wind, folder):
    """Fly the course in a wind [m/s] from the north.

    Path of the log, wall time [s], and processor time of the bridge and of ArduPilot [s].
    """
    parameters, log = folder / "sbs.parm", folder / "flight.mcap"
    environment = {**os.environ, "ROS_DOMAIN_ID": str(options.domain)}
    subprocess.run([sys.executable, BRIDGE, "--parameters", "--out", parameters], check=True, cwd=folder)
    ros = [
        "--ros-args",
        "-p",
        f"record:={log}",
        "-p",
        f"wind:=[{-wind},0.0,0.0]",
        "-p",
        "components:=[simulator, recorder]",
    ]
    place = ",".join(map(str, (*HOME, 0)))
    files = ",".join([*(str(Path(one).resolve()) for one in options.defaults), str(parameters)])
    firmware = [
        Path(options.firmware).resolve(),
        "--model",
        "JSON:127.0.0.1",
        "--speedup",
        str(options.speedup),
        "--wipe",
    ]
    firmware += ["--home", place, "--defaults", files]
    with (folder / "bridge.log").open("w") as out, (folder / "ardupilot.log").open("w") as said:
        bridge = subprocess.Popen([sys.executable, BRIDGE, *ros], stdout=out, stderr=out, cwd=folder, env=environment)
        while "recording" not in (folder / "bridge.log").read_text() and bridge.poll() is None:
            time.sleep(0.1)
        begun = processor_time(bridge)
        autopilot = subprocess.Popen(firmware, stdout=said, stderr=said, cwd=folder)
        begin = time.monotonic()
        try:
            if not Pilot(options.port).fly():
                sys.exit(f"the course was not flown: see {folder}")
            elapsed = time.monotonic() - begin
            used = processor_time(bridge) - begun, processor_time(autopilot)
        finally:
            autopilot.terminate()
            bridge.terminate()
            autopilot.wait()
            bridge.wait()
    return log, elapsed, used


def departures(north, east):
    """Distances from the course [m]."""
    position = np.stack([north, east], axis=1)
    corners = np.array([(0.0, 0.0), *POINTS], dtype=float)
    distances = []
    for begin, end in itertools.pairwise(corners):
        length = np.linalg.norm(end - begin)
        along = np.clip((position - begin) @ (end - begin) / length, 0.0, length)
        distances.append(np.linalg.norm(position - begin - along[:, None] * (end - begin) / length, axis=1))
    return np.min(distances, axis=0)


def own_errors(state, times, folder):
    """Distances [m] where ArduPilot's log has positions.

    Those of its estimates from the course, and those of the simulated positions from its targets and from its
    estimates. Both clocks count from its first frame.
    """
    from pymavlink import mavutil

    found = {"PSCN": [], "PSCE": []}
    (path,) = sorted((folder / "logs").glob("*.BIN"))[-1:]
    reader = mavutil.mavlink_connection(str(path))
    while (row := reader.recv_match(type=list(found))) is not None:
        kind = row.get_type()
        found[kind].append([1e-6 * row.TimeUS, *(getattr(row, f"{name}{kind[-1]}") for name in ("TP", "P"))])
    north, east = (np.array(rows) for rows in found.values())
    place = [np.interp(north[:, 0], times, state[f"position.{axis}"]) for axis in "xy"]
    height = np.interp(north[:, 0], times, -state["position.z"])
    east = np.stack([np.interp(north[:, 0], east[:, 0], east[:, i]) for i in (1, 2)], axis=1)
    away = [np.hypot(place[0] - north[:, 1 + i], place[1] - east[:, i]) for i in (0, 1)]
    return [one[height > AIRBORNE] for one in (departures(north[:, 2], east[:, 1]), *away)]


def main() -> None:
    """Fly and print."""
    parser = argparse.ArgumentParser(description="Let the real ArduPilot fly a course of ten way points.")
    parser.add_argument("--firmware", required=True, help="arducopter-heli, built for sitl")
    parser.add_argument("--defaults", nargs="*", default=[], help="ArduPilot's own parameter files, before ours")
    parser.add_argument("--winds", nargs="+", type=float, default=[0.0, 4.0], help="from the north [m/s]")
    parser.add_argument("--speedup", type=float, default=100.0, help="of ArduPilot (default: 100)")
    parser.add_argument("--port", type=int, default=5760, help="TCP port of ArduPilot (default: 5760)")
    parser.add_argument("--domain", type=int, default=79, help="DDS domain (default: 79)")
    parser.add_argument("--keep", metavar="FOLDER", help="keep the logs of both sides there")
    options = parser.parse_args()
    for wind in options.winds:
        with contextlib.ExitStack() as stack:
            name = options.keep or stack.enter_context(tempfile.TemporaryDirectory(prefix="course-"))
            folder = Path(name).resolve() / f"wind_{wind:g}"
            folder.mkdir(parents=True)
            report(wind, folder, *flown(options, wind, folder))


def report(wind, folder, log, elapsed, used):
    """Print what a flight was like."""
    state = read(log)["state"]
    times = state["header.stamp.sec"] + 1e-9 * state["header.stamp.nanosec"]
    north, east, height = state["position.x"], state["position.y"], -state["position.z"]
    last = float(times[-1])
    bridge, autopilot = (1e6 * one / (RATE * last) for one in used)
    print(
        f"wind {wind:g} m/s: {last:.0f} s at {last / elapsed:.1f} times real time; a frame takes {bridge:.0f} us here,"
        f" {autopilot:.0f} us in ArduPilot; load {os.getloadavg()[0]:.1f}"
    )
    distances = [departures(north, east)[height > AIRBORNE], *own_errors(state, times, folder)]
    for what, one in zip(DISTANCES, distances, strict=True):
        print(f"  {what:22}  largest {one.max():.3f} m, RMS {math.sqrt(float((one**2).mean())):.3f} m", flush=True)


if __name__ == "__main__":
    main()
