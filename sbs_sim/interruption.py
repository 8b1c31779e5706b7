"""Long calls in threads of ours look at times whether they are still wanted, and end soon after an interruption.

Only the main thread of Python learns of Ctrl-C, and it waits until those that work for it have ended.
"""

import threading
from collections.abc import Callable
from typing import Any

_own = threading.local()


class InterruptedCallError(BaseException):
    """Nobody wants the result of this call any more; no error, and not to be caught as one."""


def until(stop: threading.Event, function: Callable[..., Any], *arguments: Any) -> Any:
    """Make a call that ends by `InterruptedCallError` where it looks after an event is set."""
    _own.stop = stop
    try:
        return function(*arguments)
    finally:
        _own.stop = None


def look() -> None:
    """Raise InterruptedCallError if the call that this thread is in is not wanted any more."""
    stop = getattr(_own, "stop", None)
    if stop is not None and stop.is_set():
        raise InterruptedCallError
