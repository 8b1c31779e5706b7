"""The socket that ArduPilot's packets come to, and what of them is a new frame.

ArduPilot simulates a frame, sends a packet and waits for the answer. What is heard twice was not answered in time: it
is answered again and not flown again. A count that goes back is an ArduPilot that has started anew.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from sbs_sim.ardupilot.protocol import MAX_DATAGRAM, ServoFrame, servo_frame
from sbs_sim.errors import ArduPilotError

HOST = "127.0.0.1"
PATIENCE = 2.0  # s of silence after which another ArduPilot may take over


@dataclass
class Counts:
    """What has come: new frames, repeated ones, those missing in between, wrong packets, those of others, starts."""

    frames: int = 0
    repeated: int = 0
    lost: int = 0
    malformed: int = 0
    foreign: int = 0
    starts: int = 0


@dataclass(frozen=True)
class Frame:
    """A frame to fly; `starts` if it is the first of an ArduPilot."""

    servo: ServoFrame
    starts: bool


@dataclass
class Bridge:
    """Hears one ArduPilot on a port of this machine.

    Parameters
    ----------
    port : int
        UDP; 0 takes a free one.
    say : callable
        Takes a line for the user.

    Raises
    ------
    ArduPilotError
        The port is taken.
    """

    port: int
    say: Callable[[str], None]
    counts: Counts = field(default_factory=Counts)

    def __post_init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((HOST, self.port))
        except OSError as error:
            self._socket.close()
            raise ArduPilotError(f"cannot listen on {HOST}:{self.port}: {error.strerror}; see `port`") from None
        self.port = self._socket.getsockname()[1]
        self._partner: tuple[str, int] | None = None
        self._heard = self._timeout = -1.0
        self._newest = -1  # count of the newest frame
        self._answer: bytes | None = None  # to that frame, once it is there
        self._early: tuple[bytes, tuple[str, int]] | None = None  # what came before the answer to the newest frame
        self._last_fault = ""

    def wait(self, timeout: float) -> Frame | None:
        """The next frame to fly, or None if none comes within a time [s]. What was answered is answered again."""
        packet, self._early = self._early or self._received(timeout), None
        if packet is None:
            return None
        data, sender = packet
        try:
            frame = servo_frame(data)
        except ArduPilotError as error:
            self.counts.malformed += 1
            self._say_once(str(error))
            return None
        now = time.monotonic()
        if sender != self._partner and self._partner is not None and now < self._heard + PATIENCE:
            self.counts.foreign += 1
            self._say_once(f"{sender[0]}:{sender[1]} is not heard: {self._partner[0]}:{self._partner[1]} flies")
            return None
        starts = sender != self._partner or frame.count < self._newest
        self._partner, self._heard = sender, now
        return self._new(frame, starts)

    def answer(self, line: bytes) -> None:
        """Answer the newest frame, once: its repetitions that wait already have their answer with it.

        Each further answer would be taken for that to the next frame, and all that follows would be a frame late.
        """
        self._answer = line
        while (packet := self._received(0.0)) is not None:
            if packet[1] != self._partner or not self._is_newest(packet[0]):
                self._early = packet
                break
            self.counts.repeated += 1
        self._send(line)

    @property
    def newest(self) -> int:
        """Count of the newest frame; -1 before the first."""
        return self._newest

    def close(self) -> None:
        """Hear no more."""
        self._socket.close()

    def _received(self, timeout: float) -> tuple[bytes, tuple[str, int]] | None:
        if timeout != self._timeout:
            self._socket.settimeout(timeout)
            self._timeout = timeout
        try:
            return self._socket.recvfrom(MAX_DATAGRAM)
        except (TimeoutError, BlockingIOError, ConnectionError):  # an answer that nobody took comes back as an error
            return None

    def _is_newest(self, data: bytes) -> bool:
        try:
            return servo_frame(data).count == self._newest
        except ArduPilotError:
            return False

    def _new(self, frame: ServoFrame, starts: bool) -> Frame | None:
        """The frame, unless it was flown."""
        counts = self.counts
        if not starts and frame.count == self._newest:
            counts.repeated += 1
            if self._answer is not None:
                self._send(self._answer)
                return None
        elif not starts:
            counts.lost += frame.count - self._newest - 1
        self._newest, self._answer = frame.count, None
        counts.frames += 1
        if starts:
            counts.starts += 1
            self.say(f"ArduPilot flies, {len(frame.pulses)} channels, {frame.rate} frames per second")
        return Frame(frame, starts)

    def _send(self, line: bytes) -> None:
        try:
            if self._partner is not None:
                self._socket.sendto(line, self._partner)
        except OSError:  # it has gone: the next packet tells
            return

    def _say_once(self, fault: str) -> None:
        if fault != self._last_fault:
            self._last_fault = fault
            self.say(fault)
