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
from sbs_sim.flight.records import Motion
from sbs_sim.model import state as S
from sbs_sim.model.frames import rotation_matrix
from sbs_sim.sensors.batteries import Batteries
from sbs_sim.sensors.truth import range_along

CHANNELS = {18458: 16, 29569: 32}  # of a packet, by its magic number
HEAD, HEAD_FIELDS = struct.Struct("<HHI"), 3
PACKETS = {magic: struct.Struct(f"{HEAD.format}{number}H") for magic, number in CHANNELS.items()}
MAX_RANGE = 1000.0  # m of the range finder
MAX_DATAGRAM = 2048  # bytes, more than any packet has
# ArduPilot finds a value right behind the colon of its name: no blanks.
ENCODER = json.JSONEncoder(separators=(",", ":"), allow_nan=False)


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
    if len(data) < HEAD.size:
        sizes = " and ".join(str(packet.size) for packet in PACKETS.values())
        raise ArduPilotError(f"packet of {len(data)} bytes: allowed are {sizes}")
    magic, rate, count = HEAD.unpack_from(data)
    packet = PACKETS.get(magic)
    if packet is None:
        raise ArduPilotError(f"packet with magic number {magic}: allowed are {' and '.join(map(str, PACKETS))}")
    if len(data) != packet.size:
        raise ArduPilotError(f"packet with magic number {magic} of {len(data)} bytes: allowed are {packet.size}")
    return ServoFrame(rate, count, packet.unpack(data)[HEAD_FIELDS:])


def state_line(now: Motion, time: float, ground_altitude: float, batteries: Batteries | None = None) -> bytes:
    """What ArduPilot's sensors see of an instant, as the line that answers a packet.

    North, east, down [m], with the origin of the simulation as its home; body axes forward, right, down. An
    accelerometer at the c.g. measures the specific force: (0, 0, -9.8) m/s^2 at rest. The airspeed is the part along
    the body's x-axis that a pitot tube sees, not below 0. The range finder looks down the body's z-axis onto the level
    of the ground. ArduPilot knows one battery: several show the voltage of the weakest and the sum of their currents.

    Parameters
    ----------
    now : Motion
    time : float
        That ArduPilot's clock is to show [s].
    ground_altitude : float
        Height of the ground above the origin [m]; -inf for none.
    batteries : Batteries, optional
        Of the aircraft.
    """
    state = now.state
    attitude = state[S.ATTITUDE : S.VELOCITY]
    to_earth = rotation_matrix(attitude)
    over_ground = to_earth @ state[S.VELOCITY : S.RATES]
    ahead = float((over_ground - now.wind) @ to_earth[:, 0])
    data: dict[str, Any] = {
        "timestamp": time,
        "imu": {"gyro": state[S.RATES : S.BODY_SIZE].tolist(), "accel_body": now.specific_force.tolist()},
        "position": state[: S.ATTITUDE].tolist(),
        "quaternion": attitude.tolist(),
        "velocity": over_ground.tolist(),
        "airspeed": max(0.0, ahead),
        "velocity_wind": now.wind.tolist(),
    }
    if math.isfinite(ground_altitude):
        height = -float(state[2]) - ground_altitude
        data["rng_1"] = min(range_along(float(to_earth[2, 2]), height), MAX_RANGE)
    if batteries:
        voltage, current = batteries.voltage(state).min(), batteries.current(now.derivative).sum()
        data["battery"] = {"voltage": float(voltage), "current": float(current)}
    return f"\n{ENCODER.encode(data)}\n".encode()  # its reader wants a line break at both ends
