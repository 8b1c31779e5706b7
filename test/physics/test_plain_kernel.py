"""The compiled derivative against the plain kernel, and that against the plain reference (theory.md, 1 to 7)."""

import copy

import numpy as np
import plain_kernel
import pytest
from helpers import CALM, Model, build
from plain_model import plain_derivative
from test_dynamics import AIRCRAFT, SWITCHES, group_scales, random_case

AGREEMENT = 1e-11  # two orders above what both ways of summing lose
NAMES = ["sbs", "tail_rotor", "tilted_shafts", "four_and_five_blades"]


def hover(rng, x, swash):
    """Motion and deflections of a few per cent of a violent state's, at a pitch that carries the weight."""
    x[7 : -3 * len(swash)] *= 0.05
    swash[:] = np.array([0.15, 0.0, 0.0]) + 0.2 * swash


def forward(rng, x, swash):
    """Level flight at 10 to 25 m/s with as much disturbance."""
    hover(rng, x, swash)
    x[7] += rng.uniform(10, 25)


def stalled(rng, x, swash):
    """More pitch than any blade can take, either way, on violently moving blades: angles beyond 25 deg."""
    swash[:, 0] = rng.choice([-1, 1], len(swash)) * rng.uniform(0.6, 1.5, len(swash))


def reversed_flow(rng, x, swash):
    """Edgewise flight at 70 to 90 m/s: faster than the default retreating blade moves up to half its radius."""
    direction = rng.uniform(0, 2 * np.pi)
    x[7:9] = rng.uniform(70, 90) * np.array([np.cos(direction), np.sin(direction)])


def aircraft_of(name):
    """Aircraft without what the plain kernel leaves out; `plain_model` has it."""
    values = copy.deepcopy(AIRCRAFT[name])
    for key in ("blade_inertia", "lag_damper", "flap_rest_deg", "lag_rest_deg", "induced_power_factor"):
        values.get("every_rotor", {}).pop(key, None)
    return build(**values)


FLIGHTS = [hover, forward, stalled, reversed_flow]


def flight_case(aircraft, flight, seed):
    """Return state, swashplate angles, azimuths and wind, which is calm for every second seed."""
    x, swash, psi, wind = random_case(aircraft, seed)
    flight(np.random.default_rng(seed), x, swash)
    return x, swash, psi, wind if seed % 2 else CALM


class PlainKernel:
    """The plain kernel of an aircraft as a plain call."""

    def __init__(self, aircraft):
        self.params, self.work = plain_kernel.make_params(aircraft), plain_kernel.make_work(aircraft)

    def derivative(self, x, swash, psi, wind, lead_lag, cyclic_inflow):
        dx = np.empty_like(x)
        plain_kernel.plain_rates(self.params, x, swash, psi, wind, lead_lag, cyclic_inflow, self.work, dx)
        return dx


@pytest.mark.parametrize("flight", FLIGHTS)
@pytest.mark.parametrize("name", NAMES)
def test_the_derivative_equals_the_plain_kernel(name, flight):
    aircraft = aircraft_of(name)
    plain = PlainKernel(aircraft)
    for switches in SWITCHES:
        model = Model(aircraft, *switches)
        for seed in range(4):
            case = flight_case(aircraft, flight, seed)
            expected = plain.derivative(*case, *switches)
            error = np.abs(model.derivative(*case) - expected) / group_scales(aircraft, expected)
            assert error.max() < AGREEMENT, (switches, seed)


@pytest.mark.parametrize("name", [*NAMES, "vacuum"])
def test_the_plain_kernel_equals_the_plain_reference(name):
    aircraft = aircraft_of(name)
    plain = PlainKernel(aircraft)
    for seed, (flight, switches) in enumerate(zip(FLIGHTS, SWITCHES, strict=True)):
        case = flight_case(aircraft, flight, seed)
        expected, _ = plain_derivative(aircraft, *case, *switches)
        error = np.abs(plain.derivative(*case, *switches) - expected) / group_scales(aircraft, expected)
        assert error.max() < AGREEMENT, flight


def test_the_paper_coupling_is_refused():
    with pytest.raises(ValueError, match="coupling = 'paper': allowed is 'complete'"):
        plain_kernel.make_params(build("sbs_paper"))
