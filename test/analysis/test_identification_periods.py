"""Multisines on two controls of an unstable system under feedback: responses by whole periods, against closed form."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from sbs_sim.analysis.identification_periods import identify_periods
from sbs_sim.errors import IdentificationError
from sbs_sim.flight.excitation import multisines
from sbs_sim.flight.signals import Signals

TICK, PERIOD = 0.02, 20.0
A = np.array([[0.0, 1.0, 0.0, 0.0], [-9.0, -3.0, 0.5, 0.0], [0.0, 0.0, 0.0, 1.0], [0.3, 0.0, 1.0, -1.0]])
B = np.array([[0.0, 0.0], [9.0, 0.0], [0.0, 0.0], [1.0, 4.0]])
C = np.eye(4)[[0, 2]]
FEEDBACK = np.array([[0.0, 0.0, 0.3, 0.0], [0.0, 0.0, 2.0, 1.0]])
INPUTS, OUTPUTS, REFERENCES = ("u1", "u2"), ("y1", "y2"), ("r1", "r2")


def flown(noise=0.0, seed=0, periods=5):
    """Signals under multisines, with gusts at the controls; with a fade at both ends."""
    parts = multisines({"u1": 1.0, "u2": 1.0}, 0.5, 12.0, PERIOD, periods=periods, begin=2.0)
    time = np.arange(0.0, 2.0 + periods * PERIOD + 4.0, TICK)
    references = np.array([part.at(time) for part in parts])
    both = expm(TICK * np.block([[A, B], [np.zeros((2, 6))]]))
    gusts = noise * np.random.default_rng(seed).standard_normal((len(time), 2))
    state, gust, inputs, outputs = np.zeros(4), np.zeros(2), [], []
    for row, kick in zip(references.T, gusts, strict=True):
        gust = 0.9 * gust + kick
        outputs.append(C @ state)
        inputs.append(row - FEEDBACK @ state)
        state = both[:4, :4] @ state + both[:4, 4:] @ (inputs[-1] + gust)
    rows = [*np.array(inputs).T, *references, *np.array(outputs).T]
    values = dict(zip((*INPUTS, *REFERENCES, *OUTPUTS), rows, strict=True))
    return Signals(TICK, values, dict.fromkeys(values, "1"), frozenset((*INPUTS, *REFERENCES)))


def known(frequencies, name, output):
    """Response of the system without feedback."""
    row, column = OUTPUTS.index(output), INPUTS.index(name)
    return np.array([(C @ np.linalg.solve(1j * w * np.eye(4) - A, B))[row, column] for w in frequencies])


def test_the_system_is_unstable():
    assert np.linalg.eigvals(A).real.max() > 0.5


def test_responses_are_found_at_the_frequencies_of_each_input():
    found = identify_periods(flown(), INPUTS, OUTPUTS, PERIOD, references=REFERENCES)
    for name, output in (("u1", "y1"), ("u2", "y2")):
        one = found[name, output]
        ratio = one.response.response / known(one.frequencies, name, output)
        assert np.abs(20.0 * np.log10(np.abs(ratio))).max() < 0.15
        assert np.abs(np.degrees(np.angle(ratio))).max() < 1.0
        assert one.method == "joint"
        assert one.conditioned_on == tuple(own for own in INPUTS if own != name)
        lines = one.frequencies * PERIOD / (2.0 * math.pi)
        assert lines == pytest.approx(np.round(lines))
        assert np.all(np.diff(lines) > 1.5)  # every other harmonic


def test_the_error_is_the_scatter_from_flight_to_flight():
    departures = []
    for seed in range(6):
        found = identify_periods(flown(0.03, seed), INPUTS, OUTPUTS, PERIOD, references=REFERENCES)
        for pair in (("u1", "y1"), ("u2", "y2")):
            one = found[pair]
            use = one.frequencies < 6.0
            departures.append(
                np.abs(one.response.response / known(one.frequencies, *pair) - 1.0)[use] / one.random_error[use]
            )
    assert math.sqrt(np.mean(np.concatenate(departures) ** 2) / 2.0) == pytest.approx(1.0, abs=0.3)


def test_inputs_that_a_controller_moves_need_references():
    with pytest.raises(IdentificationError, match="u1 shares frequencies with others"):
        identify_periods(flown(), INPUTS, OUTPUTS, PERIOD)


@pytest.mark.parametrize(
    ("period", "periods", "text"),
    [(20.01, 5, "allowed are multiples of 0.02 s"), (200.0, 5, "allowed are 0.32 to 53 s"), (20.0, 2, "0 periods|1 p")],
)
def test_another_period_is_refused(period, periods, text):
    with pytest.raises(IdentificationError, match=text):
        identify_periods(flown(periods=periods), INPUTS, OUTPUTS, period, references=REFERENCES)
