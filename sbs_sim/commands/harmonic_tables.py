"""Tables of `linearize --harmonics`: hub loads and vibrations of a steady flight, sidebands of frequency responses."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sbs_sim.commands.common import DEGREES, fixed, print_table

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sbs_sim.analysis.frequency_response import FrequencyResponse
    from sbs_sim.analysis.harmonic import HarmonicModel, PeriodicModel

SMALLEST = 1e-9  # of an amplitude, in SI units: below is rounding
SHOWN = ("specific_force", "hub_force", "hub_moment")


def print_vibrations(
    model: "HarmonicModel", periodic: "PeriodicModel", speed: float, points: Mapping[str, Sequence[float]]
) -> None:
    """Mean, amplitude and phase of each harmonic; the first rotor turns at a speed [rad/s]."""
    exponents = periodic.floquet.exponents
    away = float(np.abs(model.exponents(exponents) - exponents).max())
    print(f"\nharmonic model: {model.count} harmonics of {model.frequency:.5g} rad/s, {len(model.hill)} states;")
    print(f"its poles are {away:.1e} rad/s at most from the characteristic exponents")
    print("steady flight, controls held: mean, amplitudes, and phases of the cosine from all first blades aft")
    for name, position in points.items():
        print(f"{name}: {', '.join(f'{value:g}' for value in position)} m from the c.g.")
    rows = []
    for column, name in enumerate(model.output_names):
        if name.startswith(SHOWN):
            steady = model.steady[:, column]
            cells = [cell for amplitude in steady[1:] for cell in _polar(complex(amplitude))]
            rows.append([name, model.output_units[column], fixed(steady[0].real, 4), *cells])
    headings = ["", "unit", "mean"]
    for order in range(1, model.count + 1):
        headings += [f"{order * model.frequency / speed:.4g}/rev", "phase [deg]"]
    print_table(headings, rows, left=(0, 1))


def sidebands(model: "HarmonicModel", response: "FrequencyResponse") -> tuple[list[str], list[list[str]]]:
    """Headings and columns of a response by the harmonic model: at the frequency of the control, and beside it."""
    lag: NDArray[np.complex128] = np.exp(-1j * response.frequencies * response.delay)
    if response.actuator is not None:
        lag = lag * response.actuator.at(response.frequencies)
    beside = [0, *([-1, 1] if model.count else [])]
    found = {
        order: lag * model.response(response.input_name, response.output_name, order, response.frequencies)
        for order in beside
    }
    turn = np.angle(found[0] / response.response, deg=True)
    headings = ["harmonic [dB]", "phase [deg]"]
    columns = [_decibels(found[0]), [f"{value:.1f}" for value in response.phase_deg + turn]]
    for order in beside[1:]:
        headings.append(f"at {'+' if order > 0 else '-'} {model.frequency:.4g} rad/s [dB]")
        columns.append(_decibels(found[order]))
    return headings, columns


def _polar(amplitude: complex) -> list[str]:
    if abs(amplitude) < SMALLEST:
        return ["0", ""]
    return [f"{abs(amplitude):.4g}", f"{math.atan2(amplitude.imag, amplitude.real) * DEGREES:.1f}"]


def _decibels(values: "NDArray[np.complex128]") -> list[str]:
    with np.errstate(divide="ignore"):
        return [f"{value:.2f}" for value in 20.0 * np.log10(np.abs(values))]
