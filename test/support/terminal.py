"""Commands whose stderr is a terminal."""

import fcntl
import os
import pty
import struct
import subprocess
import termios
import threading
from typing import Any

PATIENCE = 120.0  # s, generous, for machines that are busy


def on_a_terminal(command: list[str], **options: Any) -> tuple[int, str, bytes]:
    """Exit code and output of a command, and what a terminal shows that its stderr is."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    shown: list[bytes] = []

    def keep() -> None:
        while True:
            try:
                shown.append(os.read(master, 4096))
            except OSError:  # nobody has the other end any more
                return

    reader = threading.Thread(target=keep, daemon=True)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=slave, text=True, **options) as process:
        os.close(slave)
        reader.start()
        out, _ = process.communicate(timeout=PATIENCE)
    reader.join(PATIENCE)
    os.close(master)
    return process.returncode, out, b"".join(shown)
