"""Times of the derivative with what aircraft files may add, each beside that of `sbs`.

`./run python benchmarks/option_rows.py` prints them. Both are called in turn in one run, as in plain_ratio.py: the
figure is the median of the ratios of neighbours.
"""

import statistics
from pathlib import Path

from plain_ratio import Call, Row, package_calls, timed_in_turn

from sbs_sim import Aircraft, trim
from sbs_sim.flight.trimmed_state import trimmed_state

ELECTRIC = Path(__file__).resolve().parent.parent / "test" / "data" / "electric.yaml"
PARTS = {"without surfaces": ("surfaces",), "without fuselage": ("fuselage",), "with neither": ("surfaces", "fuselage")}

OPTIONS: dict[str, dict[str, object]] = {
    "measured descent": {"rotors.descent": "measured", "rotors.induced_power_factor": 1.1},
    "tip loss by Prandtl": {"rotors.tip_loss_model": "prandtl"},
    "oblique drag": {"rotors.profile_drag": "oblique"},
}


def main() -> None:
    """Print the rows."""
    for title, value, unit, note in option_rows():
        print(f"{title:<44}  {value:>8.4g} {unit:<4} {note}")


def option_rows() -> list[Row]:
    """Rows of a helicopter with airfoils over the Mach number, surfaces, fuselage, dampers, wash and drives."""
    sbs = Aircraft.load("sbs")
    many = Aircraft.load("uh60a_genhel").with_value("options.elements", sbs.options.elements)
    rows = _rows("UH-60A, 10 elements of a blade", Aircraft.load("uh60a_genhel"), sbs)
    rows += _rows(f"UH-60A, {sbs.options.elements} elements of a blade", many, sbs)
    rows += [row for name, keys in PARTS.items() for row in _rows(f"  {name}", _without(many, keys), sbs)]
    rows += _rows("sbs with interference", sbs.with_value("options.interference", "skewed_wake"), sbs)
    rows += [row for name, values in OPTIONS.items() for row in _rows(f"sbs, {name}", sbs.with_values(values), sbs)]
    return rows + _rows("sbs with an electric drive", Aircraft.load(str(ELECTRIC)), sbs)


def _without(aircraft: Aircraft, keys: tuple[str, ...]) -> Aircraft:
    """Aircraft whose body lacks some parts."""
    body = {key: value for key, value in aircraft.data["body"].items() if key not in keys}
    return Aircraft.from_dict({**aircraft.data, "body": body}, aircraft.folder)


def _rows(name: str, aircraft: Aircraft, sbs: Aircraft) -> list[Row]:
    """Time of one derivative in hover, its ratio to that of `sbs`, and that of a blade element."""
    call, other = (_call(one) for one in (aircraft, sbs))
    seconds, ratios = timed_in_turn(call, other)
    low, ratio, high = statistics.quantiles(ratios, n=4)
    elements = ratio * _elements(sbs) / _elements(aircraft)
    spread = f"{len(ratios)} pairs, middle half within {100 * (high - low) / ratio:.0f} %"
    note = f"{ratio:.2f} x sbs, {elements:.2f} x per blade element; {spread}"
    return [(f"derivative, {name}", 1e6 * seconds, "us", note)]


def _call(aircraft: Aircraft) -> Call:
    """Derivatives in hover, one after the other."""
    point = trim(aircraft)
    call, _ = package_calls(aircraft, trimmed_state(aircraft, point), point.swashplate)
    call(12)
    return call


def _elements(aircraft: Aircraft) -> int:
    return sum(rotor.blades for rotor in aircraft.rotors) * aircraft.options.elements


if __name__ == "__main__":
    main()
