"""What the commands do alike: arguments, tables, errors and interrupts.

Nothing slow is imported here, so that `--help` and a wrong argument are answered at once.
"""

import argparse
import io
import math
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from sbs_sim.errors import SbsError
from sbs_sim.output.warnings_text import joined
from sbs_sim.terminal.command_line import Parser, assignment
from sbs_sim.terminal.progress import show_compiling

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft
    from sbs_sim.analysis.frequency_response import Actuator
    from sbs_sim.concurrency.parallel import Execution
    from sbs_sim.flight.trim_point import Fidelity, TrimCondition, TrimPoint

DEGREES = 180.0 / math.pi
INTERRUPTED = 130
OUTSIDE = "outside the model's validity"


class UsageError(Exception):
    """A command line that argparse cannot know to be wrong."""


def execute(parser: Parser, work: Callable[[argparse.Namespace], None], arguments: Sequence[str] | None = None) -> int:
    """Parse the command line and work; the exit code of the process.

    Errors of this package are one line on stderr and the code 1; a wrong command line is argparse's and 2.
    """
    _behave_on_a_terminal()
    show_compiling()
    parsed = parser.parse_args(arguments)
    try:
        work(parsed)
        sys.stdout.flush()
    except UsageError as error:
        parser.error(str(error))
    except SbsError as error:
        sys.stdout.flush()
        print(" ".join(str(error).split()), file=sys.stderr)
        return 1
    except OSError as error:  # of stdout: files have errors of their own
        print(f"cannot write the output: {error.strerror}", file=sys.stderr)
        os._exit(1)  # or Python would try once more at its end
    return 0


def _behave_on_a_terminal() -> None:
    """No tracebacks for Ctrl-C (also while modules are imported), closed pipes, and characters that cannot be shown."""
    signal.signal(signal.SIGINT, _leave)
    if signal.getsignal(signal.SIGINT) is _leave:
        # And by a thread: Python's own handlers wait for the end of compiled code, and of compiling.
        reader, writer = os.pipe()
        os.set_blocking(writer, False)
        signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
        threading.Thread(target=_leave_on_interrupt, args=(reader,), name="interrupts", daemon=True).start()
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal may not know every character


def _leave(*_: Any) -> None:
    os._exit(INTERRUPTED)


def _leave_on_interrupt(reader: int) -> None:
    """Wait for the number of the signal, which the handler in C writes at once."""
    while signal.SIGINT not in os.read(reader, 16):
        pass
    _leave()


# --- arguments --------------------------------------------------------------------------------------------------


def add_aircraft_arguments(parser: Parser) -> None:
    """Aircraft and changes of it."""
    group = parser.add_argument_group("aircraft")
    group.add_argument("--aircraft", default="sbs", metavar="NAME", help="name or file (default: sbs)")
    add_set_argument(
        group,
        "change a value of the aircraft file: body.mass=25, rotors.radius=0.5 (of every rotor),"
        " rotors.MR1.hub[0]=0.01; may be repeated, all values are checked together",
    )


def add_set_argument(group: Any, text: str) -> None:
    """Changes of an aircraft, with their help."""
    group.add_argument("--set", action="append", default=[], type=assignment, metavar="PATH=VALUE", help=text)


def add_flight_arguments(parser: Parser) -> None:
    """Aircraft, flight condition and fidelity."""
    add_aircraft_arguments(parser)
    group = parser.add_argument_group("flight condition, relative to the air")
    for name, unit, meaning in (
        ("--airspeed", "m/s", "horizontal, negative for backward flight"),
        ("--climb-rate", "m/s", "positive up"),
        ("--sideslip-deg", "deg", "angle from the heading to the track, positive to the right"),
        ("--turn-rate-deg", "deg/s", "rate of the heading, positive to the right"),
    ):
        group.add_argument(name, type=float, metavar="X", help=f"{meaning} [{unit}] (default: 0)")
    group = parser.add_argument_group("fidelity")
    group.add_argument("--no-lead-lag", dest="lead_lag", action="store_false", help="hold the blades at zero lag")
    group.add_argument(
        "--no-cyclic-inflow",
        dest="cyclic_inflow",
        action="store_false",
        help="hold the cyclic inflow lambdas and lambdac at zero",
    )
    group.add_argument(
        "--azimuth-count", type=int, default=12, metavar="N", help="number of azimuths to average over (default: 12)"
    )


def add_actuator_argument(group: "argparse._ArgumentGroup") -> None:
    """Lag of the actuators."""
    group.add_argument(
        "--actuator",
        nargs=2,
        type=float,
        metavar=("W", "Z"),
        help="actuators of second order between controls and blades: natural frequency [rad/s], damping ratio",
    )


def actuator(arguments: argparse.Namespace) -> "Actuator | None":
    """Of `add_actuator_argument`.

    Raises
    ------
    LinearizationError
        A value out of range.
    """
    if arguments.actuator is None:
        return None
    from sbs_sim.analysis.frequency_response import Actuator

    return Actuator(*arguments.actuator)


def add_guess_argument(parser: argparse.ArgumentParser) -> None:
    """Where the search for a trim begins."""
    parser.add_argument(
        "--guess-deg",
        nargs=4,
        type=float,
        metavar=("COLLECTIVE", "LATERAL", "LONGITUDINAL", "YAW"),
        help="begin with these values of the controls that trims find [deg, or their units]: the trim to which they"
        " lead is taken (default: by momentum theory)",
    )


def add_worker_arguments(group: "argparse._ArgumentGroup") -> None:
    """Who does the work."""
    group.add_argument("--workers", type=int, metavar="N", help="threads (default: one for each core)")
    group.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="compute on a dask cluster with the scheduler at tcp://HOST:PORT; the results are the same",
    )


def execution(arguments: argparse.Namespace, progress: "Callable[..., None] | None") -> "Execution":
    """Who makes the calls, with the progress that is shown."""
    from sbs_sim.concurrency.parallel import Execution

    return Execution(arguments.workers, progress, dask=arguments.dask)


def aircraft(arguments: argparse.Namespace) -> "Aircraft":
    """The aircraft that the arguments select."""
    from sbs_sim.aircraft import Aircraft

    chosen = Aircraft.load(arguments.aircraft)
    return chosen.with_values(dict(arguments.set)) if arguments.set else chosen


def flight(arguments: argparse.Namespace) -> "tuple[TrimCondition, Fidelity]":
    """Flight condition, zero where it is not given, and fidelity.

    Raises
    ------
    TrimError
        A value out of range, angles in degrees as they were typed.
    """
    from sbs_sim.flight.trim_point import Fidelity, TrimCondition

    condition = TrimCondition(
        airspeed=arguments.airspeed or 0.0,
        climb_rate=arguments.climb_rate or 0.0,
        sideslip=radians("sideslip", arguments.sideslip_deg or 0.0),
        turn_rate=radians("turn_rate", arguments.turn_rate_deg or 0.0),
    )
    return condition, Fidelity(arguments.lead_lag, arguments.cyclic_inflow, arguments.azimuth_count)


def guess(arguments: argparse.Namespace, craft: "Aircraft") -> list[float] | None:
    """Controls to begin with [rad, or their units], if there are any.

    Raises
    ------
    TrimError
        One is out of range, in degrees as it was typed.
    """
    from sbs_sim import checks
    from sbs_sim.errors import TrimError

    if arguments.guess_deg is None:
        return None
    found = []
    for i, value in zip(craft.trimmed_controls, arguments.guess_deg, strict=True):
        control = craft.controls[i]
        limit, unit = control.shown(control.limit), control.shown_unit
        checks.number(f"guess_deg: {control.name}", value, -limit, limit, unit, TrimError)
        found.append(math.radians(value) if control.is_angle else value)
    return found


def radians(name: str, degrees: float) -> float:
    """An angle of a flight condition that was typed in degrees, or its rate.

    Raises
    ------
    TrimError
        It is out of range.
    """
    from sbs_sim import checks
    from sbs_sim.errors import TrimError
    from sbs_sim.flight.trim_point import LIMITS

    most, unit = LIMITS[name]
    limit = math.degrees(most)
    checks.number(f"{name}_deg", degrees, -limit, limit, unit.replace("rad", "deg"), TrimError)
    return max(-most, min(most, math.radians(degrees)))  # the limit itself may round to beyond it


# --- printing ---------------------------------------------------------------------------------------------------


def print_heading(what: str, craft: "Aircraft", point: "TrimPoint") -> None:
    """Aircraft, condition and fidelity of a trim in two lines."""
    condition = point.condition
    print(
        f"{what} of {craft.name}: airspeed {condition.airspeed:g} m/s, climb {condition.climb_rate:g} m/s,"
        f" sideslip {condition.sideslip * DEGREES:g} deg, turn {condition.turn_rate * DEGREES:g} deg/s"
    )
    lag = "with lead-lag" if point.lead_lag else "without lead-lag"
    inflow = "with cyclic inflow" if point.cyclic_inflow else "without cyclic inflow"
    print(f"{lag}, {inflow}, {point.azimuth_count} azimuths; {solution(point)}")


def print_limits(point: "TrimPoint") -> None:
    """What a trim needs beyond its limits, and where the model does not hold."""
    for text in point.beyond_limits:
        print(f"beyond its limits: {text}")
    for text in joined(point.warnings):
        print(f"{OUTSIDE}: {text}")


def solution(point: "TrimPoint") -> str:
    """How a trim was found."""
    if point.method == "two_loop":
        how = f"two loops, {point.iterations} outer and {point.inner_iterations} inner iterations"
    else:
        how = f"Newton, {point.iterations} iterations"
    return f"{how}, residual {point.residual:.1e}"


def fixed(value: float, digits: int) -> str:
    """Number with a fixed count of decimals, without a minus before zeros."""
    return f"{round(value, digits) + 0.0:.{digits}f}"


def print_table(headings: Sequence[str], rows: Sequence[Sequence[str]], left: Sequence[int] = (0,)) -> None:
    """Aligned columns.

    Parameters
    ----------
    headings : sequence of str
        One for each column.
    rows : sequence of sequence of str
    left : sequence of int
        Columns aligned to the left, as texts are; the others, numbers, are aligned to the right.
    """
    table = [headings, *rows]
    widths = [max(len(row[i]) for row in table) for i in range(len(headings))]
    for row in table:
        cells = [
            cell.ljust(width) if i in left else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        print("  ".join(cells).rstrip())
