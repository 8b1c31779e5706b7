#!/usr/bin/env python3
"""Print what options of an aircraft file do to trims, power and modes, as a table in Markdown.

    ./run python tools/effects_table.py interference:options.interference=skewed_wake
    ./run python tools/effects_table.py a:KEY=VALUE b:KEY=VALUE,KEY=VALUE --aircraft tandem --speeds 0 10

Each effect has a name and the values that it sets. It is taken alone, and with several of them all together at the end,
beside the aircraft as its file has it. Those that exclude others are named after --alone. Poles are in 1/s:
`-0.2+-1.5i`; two real ones are `-0.3, 0.1`.
"""

import argparse
from collections.abc import Sequence

import numpy as np
from ruamel.yaml import YAML

from sbs_sim import Aircraft, linearize
from sbs_sim.analysis.linear_model import LinearModel
from sbs_sim.errors import SbsError

MODES = {
    "phugoid": ("phugoid",),
    "Dutch roll": ("Dutch roll",),
    "spiral": ("spiral", "roll-spiral"),
    "heave": ("heave", "heave-yaw", "pitch divergence", "short period"),
}
HEADINGS = ("m/s", "with", "collective deg", "pitch deg", "roll deg", "power W", *(f"{name} 1/s" for name in MODES))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("effects", nargs="*", metavar="NAME:PATH=VALUE,...", help="an effect and what it sets")
    parser.add_argument("--aircraft", default="sbs")
    parser.add_argument(
        "--alone", nargs="+", default=[], metavar="NAME", help="effects that the rows with all of them leave out"
    )
    parser.add_argument("--speeds", nargs="+", type=float, default=[0.0, 5.0, 10.0, 15.0, 20.0], metavar="M/S")
    options = parser.parse_args()
    effects = [effect.split(":", 1) for effect in options.effects]
    if any(len(effect) != 2 for effect in effects):
        parser.error("an effect is NAME:PATH=VALUE,PATH=VALUE")
    settings = {"none": "", **dict(effects)}
    for name in options.alone:
        if name not in settings:
            parser.error(f"--alone {name}: there is no effect of this name")
    together = [values for name, values in effects if name not in options.alone]
    if len(together) > 1:
        settings["all"] = ",".join(together)
    base = Aircraft.load(options.aircraft)
    aircraft = {name: changed(base, values) for name, values in settings.items()}
    print(f"| {' | '.join(HEADINGS)} |\n|{'---|' * len(HEADINGS)}")
    for speed in options.speeds:
        for name, one in aircraft.items():
            print(f"| {' | '.join([f'{speed:g}', name, *cells(one, speed)])} |")


def changed(aircraft: Aircraft, values: str) -> Aircraft:
    """Aircraft with the values of `PATH=VALUE,PATH=VALUE`, as `--set` takes them."""
    pairs = [setting.partition("=") for setting in filter(None, values.split(","))]
    return aircraft.with_values({path: YAML(typ="safe", pure=True).load(value) for path, _, value in pairs})


def cells(aircraft: Aircraft, speed: float) -> list[str]:
    """Cells of a row; why there is no trim in the first of them."""
    try:
        model = linearize(aircraft, airspeed=speed)
    except SbsError as error:
        return [str(error), *[""] * (len(HEADINGS) - 3)]
    found, collective = model.trim, model.trim.controls[0]
    numbers = [f"{round(float(np.degrees(angle)), 2) + 0.0:.2f}" for angle in (collective, found.pitch, found.roll)]
    return [*numbers, f"{np.sum(found.power):.0f}", *(poles(model, names) for names in MODES.values())]


def poles(model: LinearModel, names: Sequence[str]) -> str:
    """Poles of the first of some names that modes of the body have, with the name where it is not the first."""
    for name in names:
        found = [pole(mode.pole) for mode in model.modes if mode.family == "body" and mode.name.startswith(name)]
        if found:
            return ", ".join(found) + ("" if name == names[0] else f" ({name})")
    return "-"


def pole(value: complex) -> str:
    """A pole, or a pair of them."""
    return f"{value.real:.3f}" + (f"±{abs(value.imag):.3f}i" if abs(value.imag) > 1e-9 else "")


if __name__ == "__main__":
    main()
