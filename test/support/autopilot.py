"""A stand-in for ArduPilot: speaks its JSON interface from its description, mixes servos as its helicopters do."""

import json
import math
import socket
import struct
from pathlib import Path

import numpy as np

MAGIC = {16: 18458, 32: 29569}
# Azimuths of the servos from the nose, to the right positive [deg].
PLATES = {"h3_120": (-60.0, 60.0, 180.0), "h4_90": (-90.0, 90.0, 180.0, 0.0), "h4_45": (-45.0, 45.0, -135.0, 135.0)}


def packet(count, pulses, rate=400):
    """A packet of servo pulses [us]."""
    return struct.pack(f"<HHI{len(pulses)}H", MAGIC[len(pulses)], rate, count, *pulses)


def plate(kind, roll, pitch, collective):
    """Pulses [us] of the servos of a swashplate for outputs of -1 to 1 and a collective of 0 to 1."""
    if kind == "h1":
        travels = [0.45 * roll + 0.5, 0.45 * pitch + 0.5, collective]
    elif kind == "h3_140":
        travels = [0.45 * (r * roll + p * pitch) + collective for r, p in ((1, 1), (-1, 1), (0, -1))]
    else:
        angles = [math.radians(one) for one in PLATES[kind]]
        travels = [
            0.45 * (math.cos(angle + math.pi / 2) * roll + math.cos(angle) * pitch) + collective for angle in angles
        ]
    return [round(1000 + 1000 * min(max(travel, 0.0), 1.0)) for travel in travels]


def transverse(roll, pitch, yaw, collective, channels=16):
    """Pulses of a transverse frame with two swashplates of 120 degrees."""
    left = plate("h3_120", 0.0, pitch - yaw, collective + 0.45 * roll)
    right = plate("h3_120", 0.0, pitch + yaw, collective - 0.45 * roll)
    return [*left, *right, *[0] * (channels - 6)]


class Autopilot:
    """A socket of its own that sends packets to a port and reads the answers."""

    def __init__(self, port, timeout=20.0):
        self.address = ("127.0.0.1", port)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(timeout)
        self.count = -1

    def send(self, data):
        self.socket.sendto(data, self.address)

    def frame(self, pulses, count=None):
        """Send the next frame, and return what the sensors see."""
        self.count = self.count + 1 if count is None else count
        self.send(packet(self.count, pulses))
        return self.answer()

    def answer(self):
        line = self.socket.recv(65536)
        assert line[:1] == line[-1:] == b"\n"
        assert b" " not in line
        return json.loads(line)

    def silent(self, seconds=0.3):
        """True if nothing comes for a while."""
        before = self.socket.gettimeout()
        self.socket.settimeout(seconds)
        try:
            self.socket.recv(65536)
        except TimeoutError:
            return True
        finally:
            self.socket.settimeout(before)
        return False

    def close(self):
        self.socket.close()


def attitude(quaternion):
    """Roll and pitch [rad] of a quaternion."""
    w, x, y, z = quaternion
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    return roll, math.asin(2.0 * (w * y - x * z))


def parameters(lines):
    """Values of a parameter file by name."""
    rows = (line.split() for line in lines if line and not line.startswith("#"))
    return {name: float(value) for name, value in rows}


class HoverPilot:
    """Outputs that hold a height, level, with the gains of a parameter file."""

    def __init__(self, values, height):
        self.values, self.height, self.sums = values, height, np.zeros(4)

    def outputs(self, seen, dt):
        """Roll, pitch, yaw and collective as ArduPilot's loops would give them, in rough."""
        values, rates = self.values, np.array(seen["imu"]["gyro"])
        wanted = -np.array([*attitude(seen["quaternion"]), 0.0])
        gains = [np.array([values[f"{kind}{axis}{part}"] for axis in ("RLL", "PIT", "YAW")]) for kind, part in KINDS]
        error = gains[0] * wanted - rates
        self.sums[:3] += gains[2] * error * dt
        climb = np.clip(self.height + seen["position"][2], -0.7, 0.7) + seen["velocity"][2]
        self.sums[3] = np.clip(self.sums[3] + 0.1 * climb * dt, -0.3, 0.3)
        stick = np.clip(values["H_COL_HOVER"] + 0.15 * climb + self.sums[3], 0.0, 1.0)
        travel = (values["H_COL_MIN"] - 1000 + stick * (values["H_COL_MAX"] - values["H_COL_MIN"])) / 1000
        return (*np.clip(gains[1] * error + self.sums[:3], -1.0, 1.0), travel)


KINDS = (("ATC_ANG_", "_P"), ("ATC_RAT_", "_P"), ("ATC_RAT_", "_I"))
EXAMPLE = Path(__file__).resolve().parents[2] / "config" / "ardupilot" / "sbs.yaml"
