"""Interruptions of a process: Ctrl-C, SIGTERM and SIGHUP.

Nothing heavy is imported here: Ctrl-C is obeyed while the compiled model is still being loaded.
"""

import signal
from collections.abc import Callable

DISCOVERY_TIME = 1.5  # s in which others that run already are found
INTERRUPTED = 128 + signal.SIGINT  # exit code of a program that was not meant to run until Ctrl-C


def when_interrupted(act: Callable[..., object]) -> None:
    """Set the handler of interruptions: SIGINT, SIGTERM, and SIGHUP unless it is ignored (nohup)."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if (number, signal.getsignal(number)) != (signal.SIGHUP, signal.SIG_IGN):  # nohup
            signal.signal(number, act)


def disregard_interruptions() -> None:
    """Let interruptions do nothing from now on; for use in a handler.

    Several may have arrived at once: those whose turn is next call what is set here. (SIG_IGN cannot be called: Python
    prints an error instead.)
    """
    when_interrupted(lambda *_: None)


def ignore_interruptions() -> None:
    """Ignore interruptions from now on, also while the interpreter ends; not for use in a handler.

    They are blocked while handlers are replaced: this lets those that came before act.
    """
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    for number in numbers:
        signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_SETMASK, before)


def note_interruptions(interruptions: list[int]) -> None:
    """Append the numbers of interruptions to a list, and do nothing else.

    A handler runs in the middle of what the main thread does: to set an event there could deadlock.
    """
    when_interrupted(lambda number, _: interruptions.append(number))
