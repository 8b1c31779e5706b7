"""Entry points of the executables.

They import next to nothing, so that Ctrl-C is obeyed at once while the compiled model is still being loaded.
"""

import os
import signal

INTERRUPTED = 128 + signal.SIGINT  # exit code of what was not meant to run until Ctrl-C
# The matrices are small: threads of numpy and scipy would gain nothing, and take the cores that the flight needs.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def simulator() -> None:
    """Run the executable `simulator`."""
    _end_at_once_when_interrupted()
    from sbs_sim.nodes.simulator import main

    main()


def control_mixer() -> None:
    """Run the executable `control_mixer`."""
    _end_at_once_when_interrupted()
    from sbs_sim.nodes.control_mixer import main

    main()


def analysis() -> None:
    """Run the executable `analysis`."""
    _end_at_once_when_interrupted()
    from sbs_sim.nodes.analysis import main

    main()


def hover_hold() -> None:
    """Run the executable `hover_hold`."""
    _end_at_once_when_interrupted()
    from sbs_sim.nodes.hover_hold import main

    main()


def teleop() -> None:
    """Run the executable `teleop`."""
    _end_at_once_when_interrupted()
    from sbs_sim.nodes.teleop import main

    main()


def joystick() -> None:
    """Run the executable `joystick`."""
    _end_at_once_when_interrupted()
    from sbs_sim.nodes.joystick import main

    main()


def replay() -> None:
    """Run the executable `replay`."""
    _end_at_once_when_interrupted(INTERRUPTED)
    from sbs_sim.nodes.replay import main

    main()


def cockpit() -> None:
    """Run the executable `cockpit`."""
    _end_at_once_when_interrupted()
    from sbs_sim.nodes.cockpit import main

    main()


def _end_at_once_when_interrupted(code: int = 0) -> None:
    """Until the nodes run there is nothing to be ended in good order: `sbs_sim.nodes.host.run` takes over then."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(code))
