"""Times of the derivative with what aircraft files may add, each beside that of `sbs`.

`./run python benchmarks/option_rows.py` prints them. Both are called in turn in one run, as in plain_ratio.py: the
figure is the median of the ratios of neighbours.
"""

import statistics
from pathlib import Path

import numpy as np
from plain_ratio import Call, Row, package_calls, seconds, timed_in_turn

from sbs_sim import Aircraft, Simulation, trim
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model.wind import Wind

ELECTRIC = Path(__file__).resolve().parent.parent / "test" / "data" / "electric.yaml"
PARTS = {"without surfaces": ("surfaces",), "without fuselage": ("fuselage",), "with neither": ("surfaces", "fuselage")}

OPTIONS: dict[str, dict[str, object]] = {
    "interference": {"options.interference": "skewed_wake"},
    "ground effect": {"ground.effect": "measured"},
    "contact": {"ground.contact": "contact"},
    "measured descent": {"rotors.descent": "measured", "rotors.induced_power_factor": 1.1},
    "tip loss by Prandtl": {"rotors.tip_loss_model": "prandtl"},
    "oblique drag": {"rotors.profile_drag": "oblique"},
}
UNSTEADY: dict[str, object] = {"rotors.unsteady_airfoil": "jones"}
QUASI_STEADY = {key: value for values in OPTIONS.values() for key, value in values.items()}
ALL = QUASI_STEADY | UNSTEADY
OPTIONS["all of these"] = QUASI_STEADY
OPTIONS["unsteady airfoil"] = UNSTEADY
OPTIONS["all of these, and that"] = ALL
OPTIONS["late separation"] = {"rotors.dynamic_stall": "separation"}
OPTIONS["stall by Leishman and Beddoes"] = {"rotors.dynamic_stall": "leishman_beddoes"}
SPEED = 10.0  # m/s, of ticks
TICK_PAIRS, FEW, TICKS = 25, 20, 200
GUST = {"turbulence_intensity": (1.0, 1.0, 1.0), "turbulence_airspeed": SPEED}
AIR = {extent: Wind(**GUST, turbulence_extent=extent) for extent in ("point", "field", "elements")}  # type: ignore[arg-type]


def main() -> None:
    """Print the rows."""
    for title, value, unit, note in option_rows():
        print(f"{title:<44}  {value:>8.4g} {unit:<4} {note}")


def option_rows() -> list[Row]:
    """Rows of a helicopter with many parts, of `sbs` with single options, and of one with a drive."""
    sbs = Aircraft.load("sbs")
    many = Aircraft.load("uh60a_genhel").with_value("options.elements", sbs.options.elements)
    rows = _rows("UH-60A, 10 elements of a blade", Aircraft.load("uh60a_genhel"), sbs)
    rows += _rows(f"UH-60A, {sbs.options.elements} elements of a blade", many, sbs)
    rows += [row for name, keys in PARTS.items() for row in _rows(f"  {name}", _without(many, keys), sbs)]
    rows += [row for name, values in OPTIONS.items() for row in _rows(f"sbs, {name}", sbs.with_values(values), sbs)]
    rows += _tick_rows(sbs)
    return rows + _rows("sbs with an electric drive", Aircraft.load(str(ELECTRIC)), sbs)


def _without(aircraft: Aircraft, keys: tuple[str, ...]) -> Aircraft:
    """Aircraft whose body lacks some parts."""
    body = {key: value for key, value in aircraft.data["body"].items() if key not in keys}
    return Aircraft.from_dict({**aircraft.data, "body": body}, aircraft.folder)


def _rows(name: str, aircraft: Aircraft, sbs: Aircraft) -> list[Row]:
    """Time of one derivative in hover, its ratio to that of `sbs`, and that of a blade element."""
    call, other = (_call(one) for one in (aircraft, sbs))
    time, ratios = timed_in_turn(call, other)
    low, ratio, high = statistics.quantiles(ratios, n=4)
    elements = ratio * _elements(sbs) / _elements(aircraft)
    spread = f"{len(ratios)} pairs, middle half within {100 * (high - low) / ratio:.0f} %"
    note = f"{ratio:.2f} x sbs, {elements:.2f} x per blade element; {spread}"
    return [(f"derivative, {name}", 1e6 * time, "us", note)]


def _tick_rows(sbs: Aircraft) -> list[Row]:
    """Times of a tick of flight in moving air, and with all options, and their ratios to that of `sbs` in still air."""
    full, still = sbs.with_values(ALL), _ticks(sbs, Wind())
    flights = {f"sbs, turbulence, {extent}": (sbs, air) for extent, air in AIR.items()}
    flights["sbs, all but late separation"] = full, Wind()
    flights["sbs, all but late separation, turbulence, field"] = full, AIR["field"]
    rows = []
    for name, (aircraft, air) in flights.items():
        flight = _ticks(aircraft, air)
        pairs = [(_tick_time(flight), _tick_time(still)) for _ in range(TICK_PAIRS)]
        low, ratio, high = statistics.quantiles([one / other for one, other in pairs], n=4)
        note = (
            f"{ratio:.2f} x sbs in still air; {TICK_PAIRS} pairs, middle half within {100 * (high - low) / ratio:.0f} %"
        )
        rows.append((f"tick, {name}", 1e6 * statistics.median(one for one, _ in pairs), "us", note))
    return rows


def _tick_time(flight: Call) -> float:
    """Time of a tick without what a call takes [s]."""
    return (seconds(flight, FEW + TICKS) - seconds(flight, FEW)) / TICKS


def _ticks(aircraft: Aircraft, air: Wind) -> Call:
    """Ticks of a flight from a trim, one after the other."""
    point = trim(aircraft, airspeed=SPEED)
    state = trimmed_state(aircraft, point)
    flight = Simulation(aircraft, state, point.swashplate, wind=air)

    def call(ticks: int) -> None:
        flight.reset(state, point.swashplate)
        flight.fly(np.repeat(point.swashplate[np.newaxis], ticks, axis=0), ticks, ticks, loaded=False)

    call(12)
    return call


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
