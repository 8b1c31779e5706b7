"""Non-blocking standard streams: a reader that has stopped reading must not stop the flight.

A pipe or a terminal that nobody reads is full after some lines, and then holds up whoever writes into it: Python, and
ROS too, which writes its log lines in machine code. So both standard streams get descriptions that never block. What
finds no room is lost there; ROS's log file has its lines all the same.
"""

import atexit
import io
import os
import select
import stat
import sys
from typing import Any

WRITE_TIMEOUT = 0.1  # s to wait for a slow reader; none after a wait in vain


class NonBlockingWriter(io.RawIOBase):
    """Bytes into a file descriptor, as far as they find room there: never an error, and never a long wait.

    Parameters
    ----------
    number : int
        Descriptor that does not block.
    """

    def __init__(self, number: int) -> None:
        self._number, self._stuck = number, False

    def writable(self) -> bool:
        """Yes."""
        return True

    def fileno(self) -> int:
        """The descriptor."""
        return self._number

    def isatty(self) -> bool:
        """True for a terminal."""
        return os.isatty(self._number)

    def write(self, data: Any) -> int:
        """Write what finds room; what does not counts as written."""
        rest = bytes(data)
        while rest:
            try:
                rest = rest[os.write(self._number, rest) :]
                self._stuck = False
            except BlockingIOError:
                if self._stuck or not select.select([], [self._number], [], WRITE_TIMEOUT)[1]:
                    self._stuck = True
                    break
            except OSError:  # the reader has closed it, or the disk is full
                break
        return len(data)


def make_standard_streams_non_blocking() -> None:
    """Replace both standard streams by ones that never block Python or the libraries below."""
    for number, name in ((1, "stdout"), (2, "stderr")):
        stream = getattr(sys, name)
        if stream is None:  # closed by the parent process
            continue
        stream.flush()
        _unblock(number)
        text = io.TextIOWrapper(
            io.BufferedWriter(NonBlockingWriter(number)),
            encoding=stream.encoding,
            errors="replace",
            line_buffering=True,
        )
        setattr(sys, name, text)


def _unblock(number: int) -> None:
    """Make a descriptor one that does not block, for this process alone where that can be."""
    mode = os.fstat(number).st_mode
    if stat.S_ISFIFO(mode) or stat.S_ISCHR(mode):
        try:  # opened anew it has flags of its own: the shell that has the same terminal keeps those it has
            own = os.open(f"/proc/self/fd/{number}", os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
        except OSError:  # of another user, or without a reader
            pass
        else:
            os.dup2(own, number)
            os.close(own)
            return
    if (stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode)) and os.get_blocking(number):
        os.set_blocking(number, False)
        atexit.register(os.set_blocking, number, True)
