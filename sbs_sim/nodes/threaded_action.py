"""An action server that works in threads of its own.

rclpy would have the executor carry out a goal. A single-threaded one then serves nobody else meanwhile, and a
multi-threaded one computes several answers side by side, for which the flight misses its deadlines.
"""

import contextlib
import queue
import threading
from collections.abc import Callable
from typing import Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle

from sbs_sim.nodes.component import Component

RESULT_TIMEOUT = 60  # s that a result is kept for late requests; results are large


class ThreadedActionServer(ActionServer):
    """Carries out every goal in a thread of its own, so that the node's thread goes on to serve others.

    A goal succeeds if its result says so; it can be cancelled at any time.

    Parameters
    ----------
    node : Component
        Ends the action with itself, and waits for its threads.
    kind : type
        Of the action.
    name : str
    carry_out : callable
        Takes the goal's handle and returns the result.
    succeeded : callable, optional
        Whether a goal with this result has succeeded; by default its field `success` says so.
    """

    def __init__(
        self,
        node: Component,
        kind: Any,
        name: str,
        carry_out: Callable[[ServerGoalHandle], Any],
        succeeded: Callable[[Any], bool] = lambda result: bool(result.success),
    ) -> None:
        super().__init__(
            node,
            kind,
            name,
            carry_out,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            result_timeout=RESULT_TIMEOUT,
        )
        self._carry_out, self._threads, self._succeeded = carry_out, node.workers, succeeded
        self._results: queue.SimpleQueue[tuple[ServerGoalHandle, Any]] = queue.SimpleQueue()
        self._ready = node.create_guard_condition(self._hand_over)
        node.actions.append(self)

    def notify_execute(self, goal_handle: ServerGoalHandle, execute_callback: Any) -> None:
        """Start a goal; called by rclpy where it would have its executor do the work."""
        self._threads[:] = [thread for thread in self._threads if thread.is_alive()]
        thread = threading.Thread(target=self._work, args=(goal_handle,), name="goal", daemon=True)
        self._threads.append(thread)
        thread.start()

    def _work(self, goal: ServerGoalHandle) -> None:
        self._results.put((goal, self._carry_out(goal)))
        self._ready.trigger()

    def _hand_over(self) -> None:
        """Send results, back in the node's thread."""
        with contextlib.suppress(queue.Empty):
            while True:
                goal, result = self._results.get_nowait()
                super().notify_execute(goal, lambda goal, result=result: self._close(goal, result))

    def _close(self, goal: ServerGoalHandle, result: Any) -> Any:
        if self._succeeded(result):
            goal.succeed()
        elif goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.abort()
        return result
