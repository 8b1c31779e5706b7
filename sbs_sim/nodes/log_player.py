"""Player of a log: publishes the recorded topics with the recorded timing."""

import itertools
import math
import threading
import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mcap.records import Channel
from rclpy.exceptions import NameValidationException
from std_srvs.srv import SetBool

from sbs_sim.errors import RecordingError, SbsError
from sbs_sim.nodes.component import Component
from sbs_sim.nodes.message_types import fit_of, installed_type
from sbs_sim.nodes.process import ROS_ERRORS
from sbs_sim.nodes.qos import SERVICE_QOS
from sbs_sim.nodes.recorded_qos import recorded_qos
from sbs_sim.nodes.signals import DISCOVERY_TIME
from sbs_sim.recording.cdr import Fit, plain
from sbs_sim.recording.flight_topics import mixed, several
from sbs_sim.recording.playback import Playback, Progress

# every node may publish these, in any namespace
SHARED_TOPICS = frozenset(("rosout", "parameter_events", "diagnostics", "tf", "tf_static"))
CHECK_PERIOD = 0.05  # s between checks for other publishers
# Time of playing in which other publishers are looked for [s]: discovery is slow on a busy machine.
CONFLICT_CHECK_TIME = 10.0
MIN_PASS_TIME = 0.05  # s of wall time for one pass of a loop, however short the log is


@dataclass(frozen=True)
class PlayOptions:
    """How a log is played.

    Parameters
    ----------
    rate : float
        Recorded time over wall time.
    start, end : float
        Part of the log, from its first message on [s].
    loop : bool
        Start again at the end.
    topics : sequence of str
        Those to publish; all if empty.
    delay : float
        Maximum wait until every topic has a subscriber [s]; at least DISCOVERY_TIME.
    """

    rate: float
    start: float
    end: float
    loop: bool
    topics: Sequence[str]
    delay: float


class LogPlayer(Component):
    """Publishes a log.

    Parameters
    ----------
    playback : Playback
    options : PlayOptions
    ended : threading.Event
        Set at the end of the log.
    progress : callable, optional
        Called with the recorded time that has been played and that will be [s].

    Attributes
    ----------
    failure : str
        Why the log could not be played to its end, in one line; empty if it was.
    """

    def __init__(
        self,
        playback: Playback,
        options: PlayOptions,
        ended: threading.Event,
        progress: Progress | None = None,
    ) -> None:
        super().__init__("replay")
        self._playback, self._options = playback, options
        self.failure = ""
        if playback.warning:
            self.get_logger().warning(playback.warning)
        self._left_out: dict[str, int] = {}  # messages that are none of their topic's type
        self._fits: dict[int, Fit] = {}
        self._outputs = self._make_publishers(options.topics)
        self._wake = threading.Condition()
        self._paused = self._stopping = False
        self._ended, self._progress = ended, progress
        self._next_check, self._check_end = 0.0, math.inf
        self.create_service(SetBool, "pause", self._on_pause, qos_profile=SERVICE_QOS)
        self._thread = threading.Thread(target=self._play, name="replay", daemon=True)
        self._thread.start()

    def _make_publishers(self, topics: Sequence[str]) -> dict[int, Any]:
        """Publisher of each channel that is wanted and whose type is installed."""
        channels = self._playback.channels
        if unknown := set(topics) - {name for channel in channels.values() for name in _names(channel)}:
            names = ", ".join(sorted({channel.topic for channel in channels.values()}))
            raise SbsError(f"--topics {min(unknown)}: the log has {names or 'none'}")
        self._refuse_mixture([channel for channel in channels.values() if not topics or _names(channel) & set(topics)])
        found: dict[int, Any] = {}
        by_topic: dict[str, tuple[Any, Any]] = {}
        for channel in channels.values():
            if topics and not _names(channel) & set(topics):
                continue
            try:
                kind = installed_type(channel, self._playback.schema(channel))
                if channel.topic not in by_topic:
                    qos = recorded_qos(channel.metadata.get("offered_qos_profiles", ""))
                    by_topic[channel.topic] = kind, self.create_publisher(kind, channel.topic, qos)
            except NameValidationException:
                self.get_logger().warning(f"{channel.topic}: left out, ROS does not allow this name")
            except SbsError as error:
                self.get_logger().warning(f"{channel.topic}: left out, {error}")
            else:
                first, found[channel.id] = by_topic[channel.topic]
                self._fits[channel.id] = fit_of(self._playback.schema(channel))
                if kind is not first:
                    self.get_logger().warning(f"{channel.topic}: partly left out, it was recorded with two types")
                    del found[channel.id]
        return found

    def _refuse_mixture(self, wanted: Sequence[Channel]) -> None:
        """Raise SbsError if a topic would have the messages of several flights."""
        parts = self._playback.flights
        if mixed(wanted, parts):
            raise SbsError(several(self._playback.path, [part.title for part in parts]))

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        with self._wake:
            self._paused = request.data
            self._wake.notify()
        response.success, response.message = True, "paused" if request.data else "playing"
        return response

    def _play(self) -> None:
        try:
            self._wait_for_discovery()
            for _ in itertools.count() if self._options.loop else range(1):
                pass_start = time.monotonic()
                if not self._play_once() or self._wait_until(pass_start + MIN_PASS_TIME) is None:
                    break
            if self._left_out:
                listed = ", ".join(f"{count} of {topic}" for topic, count in sorted(self._left_out.items()))
                self.failure = f"{self._playback.path}: messages that are not of their type were left out: {listed}"
        except SbsError as error:
            self.failure = str(error)
        except Exception as error:  # internal
            self.get_logger().error(f"internal error: {traceback.format_exc()}")
            self.failure = f"internal error, see above: {error!r}"
        finally:
            self._ended.set()

    def _wait_for_discovery(self) -> None:
        """Wait for the discovery of other publishers, and of the subscribers that are to get the first message."""
        begin = time.monotonic()
        timeout = DISCOVERY_TIME
        with self._wake:
            while not self._stopping and (left := begin + timeout - time.monotonic()) > 0:
                self._wake.wait(min(left, CHECK_PERIOD))
                self._check_conflicts()
                subscribed = all(output.get_subscription_count() for output in self._outputs.values())
                timeout = DISCOVERY_TIME if subscribed else max(DISCOVERY_TIME, self._options.delay)
        self._check_end = time.monotonic() + CONFLICT_CHECK_TIME

    def _check_conflicts(self) -> None:
        """Raise SbsError if another node publishes a topic: recorded commands would fly its simulator."""
        now = time.monotonic()
        if not self._next_check <= now < self._check_end:
            return
        self._next_check = now + CHECK_PERIOD
        for name in sorted({output.topic_name for output in self._outputs.values()}):
            if not is_shared(name) and self.count_publishers(name) > 1:
                remedy = "choose others with --topics, or use another ROS_DOMAIN_ID"
                raise SbsError(f"another node publishes {name} already: {remedy}")

    def _play_once(self) -> bool:
        """Publish the log from start to end; false if stopped."""
        anchor: float | None = None
        begin = 0
        length = min(self._options.end, self._playback.duration) - self._options.start
        for log_time, channel, data in self._playback.messages(self._options.start, self._options.end):
            if channel not in self._outputs:
                continue
            if anchor is None:
                anchor, begin = time.monotonic(), log_time
            held = self._wait_until(anchor + (log_time - begin) * 1e-9 / self._options.rate)
            if held is None:
                return False
            anchor += held
            self._check_conflicts()
            self._publish(channel, (log_time - begin) * 1e-9, data)
            if self._progress is not None:
                self._progress(min((log_time - begin) * 1e-9, length), length)
        if anchor is None:
            raise RecordingError(f"{self._playback.path}: there is nothing to play in this part or on these topics")
        return True

    def _publish(self, channel: int, time: float, data: bytes) -> None:
        """Publish a message; an invalid one is left out, since it would crash its subscribers."""
        output = self._outputs[channel]
        try:
            data = plain(data)
            self._fits[channel].check(data)
            output.publish(data)
        except (RecordingError, *ROS_ERRORS) as error:
            topic = output.topic_name
            if topic not in self._left_out:
                refused = f"ROS does not publish these {len(data)} bytes"  # it says no more itself
                why = str(error) if isinstance(error, RecordingError) else refused
                self.get_logger().warning(f"{topic}: messages are left out, the first at {time:.3f} s: {why}")
            self._left_out[topic] = self._left_out.get(topic, 0) + 1

    def _wait_until(self, due: float) -> float | None:
        """Sleep until a wall time; how long a pause held it up [s], None at the end."""
        held = 0.0
        with self._wake:
            while not self._stopping:
                now = time.monotonic()
                if self._paused:
                    self._wake.wait()
                    held += time.monotonic() - now
                elif due + held > now:
                    self._wake.wait(due + held - now)
                else:
                    return held
        return None

    def stop(self) -> None:
        """End the playing."""
        with self._wake:
            self._stopping = True
            self._wake.notify()
        self._thread.join()


def _names(channel: Channel) -> set[str]:
    """What a topic may be called on the command line."""
    return {channel.topic, channel.topic.lstrip("/")}


def is_shared(topic: str) -> bool:
    """True for topics of which every node may be a publisher."""
    return topic.rpartition("/")[2] in SHARED_TOPICS
