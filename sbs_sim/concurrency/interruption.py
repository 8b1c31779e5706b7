"""Long calls in threads of ours look at times whether they are still wanted, and end soon after an interruption.

Only the main thread of Python learns of Ctrl-C, and it waits until those that work for it have ended.
"""

import functools
import signal
import threading
from collections.abc import Callable
from types import FrameType
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


def raised_outside(file: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Function of which an interruption that comes while code of a file runs is raised at its end, not there."""

    @functools.wraps(function)
    def call(*arguments: Any, **names: Any) -> Any:
        handler = signal.getsignal(signal.SIGINT)
        if threading.current_thread() is not threading.main_thread() or not callable(handler):
            return function(*arguments, **names)
        late: list[tuple[int, FrameType | None]] = []

        def handle(number: int, frame: FrameType | None) -> None:
            if _is_within(file, frame):
                late.append((number, frame))
            else:
                handler(number, frame)

        signal.signal(signal.SIGINT, handle)
        try:
            return function(*arguments, **names)
        finally:
            signal.signal(signal.SIGINT, handler)
            for asked in late[:1]:
                handler(*asked)

    return call


def _is_within(file: str, frame: FrameType | None) -> bool:
    while frame is not None and frame.f_code.co_filename != file:
        frame = frame.f_back
    return frame is not None
