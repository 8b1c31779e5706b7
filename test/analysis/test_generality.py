"""Aircraft of every kind with every key: a sample of tools/robustness/generality.py."""

import functools

import numpy as np
import pytest
from aircraft_laws import CONSERVED, MIRROR, balance_errors, mirror_error, mode_faults
from random_options import ALL_KINDS, equipped_flights

from sbs_sim import linearize, trim
from sbs_sim.analysis.modes import Mode
from sbs_sim.errors import TrimError

SEED = 6  # of which ten aircraft have all keys
NUMBERS = range(10)

WITHOUT_TRIM = {5: "^no trim: a rotor alone has nothing against its torque"}


@functools.cache
def sample(number):
    return equipped_flights(SEED, number)


@pytest.mark.parametrize("number", NUMBERS)
def test_mirror_symmetry_momentum_and_energy(number):
    """The image flies the image; loads and powers account for every change, torque reaction and engines included."""
    _, aircraft, _ = sample(number)
    assert mirror_error(aircraft, number) < MIRROR
    errors = balance_errors(aircraft, number)
    assert max(errors.values()) < CONSERVED, errors


def test_the_sample_has_every_key():
    """Otherwise it shows less than it says."""
    texts = [str(dict(sample(number)[1].data)) for number in NUMBERS]
    for key in (
        *("stations", "blade_inertia", "flap_rest_deg", "lag_rest_deg", "lag_damper", "blade_lag_damping", "'wash'"),
        *("surfaces", "schedule", "polar", "fuselage", "grid", "altitude", "sc1095r8", "held_deg", "drives"),
        *(
            "'electric'",
            "'engine'",
            "governor",
            "free_wheel",
            "stand",
            "swashplate_offset_deg",
            "lip_arm",
            "induced_power_factor",
            "quarter_chord",
            "chordwise_cg",
            "lag_stop",
        ),
    ):
        assert any(key in text for text in texts), key
    blades = {rotor.blades for number in NUMBERS for rotor in sample(number)[1].rotors}
    assert blades == set(range(3, 8))


@pytest.mark.parametrize("number", range(len(ALL_KINDS)))
def test_each_trims_and_its_modes_have_the_names_of_what_takes_part(number):
    """Or says in a line why not."""
    _, aircraft, flights = sample(number)
    name = next(iter(flights))
    if number in WITHOUT_TRIM:
        with pytest.raises(TrimError, match=WITHOUT_TRIM[number]):
            trim(aircraft, **flights[name])
        return
    point = trim(aircraft, **flights[name])
    model = linearize(aircraft, point=point)
    assert point.residual < 1e-8
    assert np.isfinite(model.a).all()
    assert mode_faults(model) == []


def test_a_wrong_name_is_seen(hover, sbs):
    """The check of names sees a family, a rotor and a name that are not those with the largest shares."""
    model = linearize(sbs, point=hover)
    heave = model.mode("heave subsidence")
    wrong = Mode(heave.name, heave.pole, heave.vector, heave.participation, "lag", (1,))
    object.__setattr__(model, "modes", (wrong, *(mode for mode in model.modes if mode is not heave)))
    assert mode_faults(model) == ["'heave subsidence' is of lag, the largest share body has"]
