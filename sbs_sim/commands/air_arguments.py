"""Options of commands that fly through moving air, and the fields of a `Wind` that they give."""

import argparse
from typing import TYPE_CHECKING, Any

from sbs_sim.commands.common import UsageError

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft


def add_air_arguments(group: Any) -> None:
    """Add the options."""
    group.add_argument(
        "--spectrum", choices=("dryden", "von_karman"), help="spectra of the turbulence (default: dryden)"
    )
    group.add_argument(
        "--extent",
        choices=("point", "rates", "field", "elements"),
        help="turbulence is the same everywhere (point, default), turns the air with p, q and r of MIL-F-8785C (rates),"
        " or is a field in space that every rotor (field) or every blade element (elements) meets where it is",
    )
    group.add_argument(
        "--severity",
        choices=("light", "moderate", "severe"),
        help="intensities and scale lengths of MIL-F-8785C at --height, in place of --turbulence and --length",
    )
    group.add_argument("--height", type=float, metavar="X", help="height above the ground of --severity [m]")
    group.add_argument(
        "--gust-file", metavar="FILE", help="own gust: CSV with time [s] or distance [m], and north, east, down [m/s]"
    )


def air_fields(arguments: argparse.Namespace, craft: "Aircraft") -> dict[str, Any]:
    """Fields of a `Wind` that the options give, without those that were not given."""
    from sbs_sim.flight.gust_file import read_gust
    from sbs_sim.flight.gust_standards import specified_turbulence

    fields: dict[str, Any] = {}
    if (arguments.severity is None) != (arguments.height is None):
        raise UsageError("--severity, --height: allowed are both or neither")
    if arguments.severity is not None:
        model = arguments.spectrum or "dryden"
        fields |= specified_turbulence(arguments.height, arguments.severity, model=model)
    elif arguments.spectrum is not None:
        fields["turbulence_model"] = arguments.spectrum
    if arguments.extent is not None:
        fields["turbulence_extent"] = arguments.extent
        if arguments.extent == "rates":
            fields["turbulence_span"] = craft.rotor_span
    if arguments.gust_file is not None:
        fields["own_gust"] = read_gust(arguments.gust_file)
    return fields
