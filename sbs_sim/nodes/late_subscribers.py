"""Subscribers that join while a flight is paused."""

from collections.abc import Callable, Sequence

from sbs_sim.nodes.recorded_publisher import RecordedPublisher

REPEAT_AFTER = 10  # updates until the messages are sent once more: a best-effort subscriber may have missed one


class LateSubscribers:
    """Publishes the present state again when a subscriber joins during a pause.

    A paused flight publishes no state, and DDS does not deliver earlier messages to a late subscriber. The other
    subscribers get the same message with the same stamp again. It is not recorded again.

    Parameters
    ----------
    topics : sequence of (RecordedPublisher, callable)
        Publishers, and functions that return the serialised message they published last.
    """

    def __init__(self, topics: Sequence[tuple[RecordedPublisher, Callable[[], bytes]]]) -> None:
        self._topics = topics
        self._subscribers: list[int] = []  # subscribers at the last update
        self._updates_left = [0] * len(topics)  # until the repeated message

    def update(self, paused: bool) -> None:
        """Serve new subscribers; called in the publishing thread before each publication."""
        subscribers = [topic.subscribers for topic, _ in self._topics]
        if paused and self._subscribers:
            for i, (topic, last) in enumerate(self._topics):
                if subscribers[i] > self._subscribers[i]:
                    self._updates_left[i] = REPEAT_AFTER + 1
                if self._updates_left[i] in (REPEAT_AFTER + 1, 1):
                    topic.publish_again(last())
                self._updates_left[i] = max(self._updates_left[i] - 1, 0)
        self._subscribers = subscribers
