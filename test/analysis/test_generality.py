"""Aircraft of every kind with every key: a sample of tools/robustness/generality.py."""

import functools

import numpy as np
import pytest
from aircraft_laws import CONSERVED, MIRROR, balance_errors, inflow_error, mirror_error, mode_faults
from random_options import ALL_KINDS, NEVER_DRAWN, drawn_keys, equipped_flights, schema_keys

from sbs_sim import linearize, trim
from sbs_sim.analysis.modes import Mode
from sbs_sim.errors import TrimError
from sbs_sim.flight.two_blades import has_two_blades

SEED = 6  # of which ten aircraft have nearly all keys
NUMBERS = range(10)
LACKING = {"body.fuselage.roll.alpha", "controls.*.held", "options.interference = skewed_wake"}
LACKING |= {"rotors.ring_unsteadiness"}  # without an effect on the derivative

WITHOUT_TRIM = {5: "^no trim: a rotor alone has nothing against its torque"}


@functools.cache
def sample(number):
    return equipped_flights(SEED, number)


@pytest.mark.parametrize("number", NUMBERS)
def test_mirror_symmetry_momentum_and_energy(number):
    """The image flies the image; loads and powers account for every change, torque reaction and engines included.

    The inflow is that of the plain model.
    """
    _, aircraft, _ = sample(number)
    assert mirror_error(aircraft, number) < MIRROR
    assert inflow_error(aircraft, number) < CONSERVED
    errors = balance_errors(aircraft, number)
    assert max(errors.values()) < CONSERVED, errors


def test_the_sample_has_every_key():
    """Otherwise it shows less than it says; what it lacks has tests of its own."""
    known = schema_keys()
    drawn = set().union(*(drawn_keys(dict(sample(number)[1].data), known) for number in NUMBERS))
    assert known - drawn - set(NEVER_DRAWN) == LACKING
    assert set(NEVER_DRAWN) <= known
    assert {rotor.blades for number in NUMBERS for rotor in sample(number)[1].rotors} == set(range(2, 8))


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
    assert point.residual < 1e-8
    if has_two_blades(aircraft):
        return  # without a constant matrix
    model = linearize(aircraft, point=point)
    assert np.isfinite(model.a).all()
    assert mode_faults(model) == []


def test_a_wrong_name_is_seen(hover, sbs):
    """The check of names sees a family, a rotor and a name that are not those with the largest shares."""
    model = linearize(sbs, point=hover)
    heave = model.mode("heave subsidence")
    wrong = Mode(heave.name, heave.pole, heave.vector, heave.participation, "lag", (1,))
    object.__setattr__(model, "modes", (wrong, *(mode for mode in model.modes if mode is not heave)))
    assert mode_faults(model) == ["'heave subsidence' is of lag, the largest share body has"]
