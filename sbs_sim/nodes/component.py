"""Base class of the nodes of this package."""

import threading
import traceback
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rclpy.node import Node

from sbs_sim.errors import SbsError
from sbs_sim.nodes.confinement import check_confinement
from sbs_sim.nodes.number_fields import check_numbers, hint

if TYPE_CHECKING:  # most nodes have no action
    from rclpy.action import ActionServer


class Component(Node):
    """A node of this package.

    Attributes
    ----------
    workers : list of Thread
        Threads of its own that `stop` lets end.
    actions : list of ActionServer
        Its action servers.
    """

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        check_confinement()
        self.workers: list[threading.Thread] = []
        self.actions: list[ActionServer] = []

    def stop(self) -> None:
        """Unblock waiting callbacks; called once, before the node's thread is joined."""

    def finish(self) -> None:
        """Save what must not be lost; called once, after `stop` and after the node's thread."""

    def destroy_node(self) -> None:
        """End the actions, which rclpy forgets, then the node."""
        for server in self.actions:
            server.destroy()
        super().destroy_node()

    def answer(self, response: Any, act: Callable[[], Any], done: str, request: Any) -> Any:
        """Carry out a request and say how it went; an error changes nothing and is in the response."""
        try:
            check_numbers(request)
            act()
        except SbsError as error:
            response.success, response.message = False, f"{error}{hint(request)}"
        except Exception as error:  # an internal error must not end the flight
            self.get_logger().error(f"internal error: {traceback.format_exc()}")
            response.success, response.message = False, f"internal error, see the log: {error!r}"
        else:
            response.success, response.message = True, done
        return response
