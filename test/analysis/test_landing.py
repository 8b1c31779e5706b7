"""Take-off and landing by the hover hold, in the loop of the library: phases, heights, forces."""

import math

import numpy as np
import pytest
from helpers import aircraft_data

from sbs_sim import Aircraft, linearize, trim
from sbs_sim.errors import TrimError
from sbs_sim.flight.contact import ground_forces, state_on_ground
from sbs_sim.model.wind import Wind
from sbs_sim.pilot.hover_hold import HoverHold, HoverModel, design
from sbs_sim.pilot.landing import FLYING, LIFTING, PHASES, SETTLING, STANDING, Landing
from sbs_sim.pilot.piloted_flight import simulate_with_pilot

GROUND = {"contact": "contact", "effect": "measured", "altitude": -1.5}
STANDS = 1.5 - 0.29  # m, down coordinate of the c.g. on its skids


@pytest.fixture(scope="module")
def aircraft():
    return Aircraft.from_dict(aircraft_data(options={"elements": 6}) | {"ground": GROUND})


@pytest.fixture(scope="module")
def pilot(aircraft):
    """Hover hold with take-off and landing, for one flight after the other."""
    model = HoverModel.of(linearize(aircraft))
    return Landing(HoverHold(design(model)), model.controls, model.axes)


def fly(aircraft, pilot, targets, duration, **options):
    """Flight with targets at times, and the phases of it."""
    pilot.restart()
    phases, waiting, model = [], sorted(targets, key=lambda item: item[0]), aircraft.model()

    def controls(time, state):
        while waiting and time >= waiting[0][0]:
            pilot.hold(*waiting.pop(0)[1:])
        depths = ground_forces(model, np.array(state)[np.newaxis])[0, :, 3]
        found = pilot.controls(time, state, float((depths > 0.0).mean()))
        phases.append(pilot.phase)
        return found

    start = state_on_ground(aircraft, aircraft.ground.altitude)
    return simulate_with_pilot(aircraft, start, controls, duration, delay=1, **options), phases


@pytest.mark.parametrize("wind", [(0.0, 0.0, 0.0), (-3.0, 1.0, 0.0)])
def test_it_takes_off_hovers_turns_and_lands(aircraft, pilot, wind):
    """Every phase once, in order; it hovers where it is told, touches down gently, and stands with all its weight."""
    targets = [(0.2, (0.0, 0.0, 0.7), 0.0), (6.0, (0.0, 0.0, 0.7), 0.5), (10.0, (0.2, 0.1, 1.4), 0.5)]
    flight, phases = fly(aircraft, pilot, targets, 19.0, wind=Wind(velocity=wind))
    assert list(dict.fromkeys(phases)) == [STANDING, LIFTING, FLYING, SETTLING]
    assert set(phases) == set(PHASES)
    hover = round(10.0 / 0.01)
    assert flight["down"][hover] == pytest.approx(0.7, abs=0.15)
    assert flight["psi"][hover] == pytest.approx(0.5, abs=0.1)
    touch = phases.index(SETTLING)
    assert np.abs(flight["w"][touch - 100 : touch]).max() < 0.35, "m/s"
    assert (flight["contact_force"][hover] == 0.0).all()
    assert phases[-1] == STANDING
    weight = 20.62 * 9.80665
    assert flight["contact_force"][-1, :, 2].sum() == pytest.approx(-weight, rel=0.02)
    assert flight["down"][-1] == pytest.approx(STANDS, abs=2e-3)
    assert math.hypot(flight["north"][-1] - 0.2, flight["east"][-1] - 0.1) < 0.4
    assert flight["controls"][-1, 0] == 0.0
    still = flight["state"][-50:, :3]
    np.testing.assert_allclose(still - still[-1], 0.0, atol=2e-4)


def test_without_contact_points_it_is_the_hover_hold(aircraft, pilot):
    """Targets act at once, whatever their height."""
    model = HoverModel.of(linearize(aircraft))
    alone = HoverHold(design(model))
    body = np.zeros(13)
    body[3] = 1.0
    pilot.restart()
    for one in (pilot, alone):
        one.hold([1.0, 0.0, -2.0], 0.3)
    for i in range(3):
        np.testing.assert_array_equal(pilot.controls(0.01 * i, body, None), alone.controls(0.01 * i, body))


def test_trims_are_not_in_the_ground(aircraft):
    """A line that says where the ground may be."""
    with pytest.raises(TrimError, match=r"ground\.altitude = -0.2: allowed for trims, .* is below -0.3$"):
        trim(aircraft.with_value("ground.altitude", -0.2))
    with pytest.raises(TrimError, match=r"is below -0.066$"):
        trim(aircraft.with_values({"ground.altitude": 0.0, "ground.contact": "end_flight"}))
