"""ArduPilot's JSON physics interface: packets of servo pulses come in, lines of JSON go out.

Source: the readme of ArduPilot's SITL JSON backend (libraries/SITL/examples/JSON/readme.md). A packet is little-endian:
a magic number, which says how many channels there are, the frame rate [Hz], a count of frames, and pulses [us].
"""

from __future__ import annotations

import json
import math
import struct
from dataclasses import dataclass
from typing import Any

from sbs_sim.errors import ArduPilotError
from sbs_sim.flight.records import Snapshot
from sbs_sim.model import state as S
from sbs_sim.model.frames import rotation_matrix
from sbs_sim.sensors.truth import range_down, specific_force

CHANNELS = {18458: 16, 29569: 32}  # of a packet, by its magic number
HEAD = struct.Struct("<HHI")
MAX_RANGE = 1000.0  # m of the range finder
MAX_DATAGRAM = 2048  # bytes, more than any packet has


@dataclass(frozen=True)
class ServoFrame:
    """A packet of ArduPilot.

    Attributes
    ----------
    rate : int
        Frames per second that it simulates [Hz].
    count : int
        Of the frame; starts again when ArduPilot does.
    pulses : tuple of int
        Lengths of the servo pulses [us], 16 or 32; 0 is no pulse.
    """

    rate: int
    count: int
    pulses: tuple[int, ...]


def servo_frame(data: bytes) -> ServoFrame:
    """Frame of a packet.

    Raises
    ------
    ArduPilotError
        It is none: its length or magic number, and what is allowed.
    """
    sizes = {magic: HEAD.size + 2 * count for magic, count in CHANNELS.items()}
    if len(data) < HEAD.size:
        raise ArduPilotError(f"packet of {len(data)} bytes: allowed are {' and '.join(map(str, sizes.values()))}")
    magic, rate, count = HEAD.unpack_from(data)
    if magic not in sizes:
        raise ArduPilotError(f"packet with magic number {magic}: allowed are {' and '.join(map(str, sizes))}")
    if len(data) != sizes[magic]:
        raise ArduPilotError(f"packet with magic number {magic} of {len(data)} bytes: allowed are {sizes[magic]}")
    return ServoFrame(rate, count, struct.unpack_from(f"<{CHANNELS[magic]}H", data, HEAD.size))


def state_line(now: Snapshot, time: float, gravity: float, ground_altitude: float) -> bytes:
    """What ArduPilot's sensors see of an instant, as the line that answers a packet.

    North, east, down [m], with the origin of the simulation as its home; body axes forward, right, down. An
    accelerometer at the c.g. measures the specific force: (0, 0, -9.8) m/s^2 at rest. The airspeed is the part along
    the body's x-axis that a pitot tube sees, not below 0. The range finder looks down the body's z-axis onto the level
    of the ground.

    Parameters
    ----------
    now : Snapshot
        With loads.
    time : float
        That ArduPilot's clock is to show [s].
    gravity : float
        [m/s^2]
    ground_altitude : float
        Height of the ground above the origin [m]; -inf for none.
    """
    state = now.state
    attitude, velocity = state[S.ATTITUDE : S.VELOCITY], state[S.VELOCITY : S.RATES]
    to_earth = rotation_matrix(attitude)
    over_ground = to_earth @ velocity
    ahead = float((over_ground - now.wind) @ to_earth[:, 0])
    data: dict[str, Any] = {
        "timestamp": time,
        "imu": {
            "gyro": state[S.RATES : S.BODY_SIZE].tolist(),
            "accel_body": specific_force(now, gravity).tolist(),
        },
        "position": state[: S.ATTITUDE].tolist(),
        "quaternion": attitude.tolist(),
        "velocity": over_ground.tolist(),
        "airspeed": max(0.0, ahead),
        "velocity_wind": now.wind.tolist(),
    }
    if math.isfinite(ground_altitude):
        data["rng_1"] = min(range_down(now, ground_altitude), MAX_RANGE)
    # ArduPilot finds a value right behind the colon of its name: no blanks. Its reader wants a line break at both ends.
    return b"\n" + json.dumps(data, separators=(",", ":"), allow_nan=False).encode() + b"\n"
