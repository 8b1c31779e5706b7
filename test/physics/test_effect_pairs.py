"""Every two effects of the air and the ground together: symmetry, momentum, energy, continuity, and their limits.

The plain reference has momentum and moments of each by its own equations; the balance of power has no remainder term.
"""

import itertools

import numpy as np
import pytest
from helpers import CALM, POLAR, Model, aircraft_data, mirrored_data, mirrored_state, mirrored_swash
from plain_model import plain_derivative, random_state

from sbs_sim import Aircraft
from sbs_sim.flight.power_balance import power_balance
from sbs_sim.model import state as S
from sbs_sim.model.power import POWER_TERMS, SUPPLY
from sbs_sim.model.records import NOISE

FAR = 1e3  # m
HEIGHT = 0.29  # m of the c.g. above the ground: skids 10 mm deep, hubs 0.44 radii high
ROTOR = {
    "ring": {"descent": "measured", "induced_power_factor": 1.1, "ring_unsteadiness": 0.2},
    "sections": {"tip_loss_model": "prandtl", "profile_drag": "oblique"},
    "ducts": {"duct": {"exit_area": 0.9, "turning": 0.5, "lip_arm": 0.1, "lip_stall": 1.0}},
}
OPTIONS = {"wakes": {"interference": "skewed_wake"}}
GROUND = {"ground effect": {"effect": "measured"}, "skids": {"contact": "contact"}}
EFFECTS = ("wakes", "ring", "ground effect", "skids", "sections", "ducts", "gusts")
PAIRS = [pair for pair in itertools.combinations(EFFECTS, 2) if pair != ("ring", "ducts")]  # which is refused
SIGNS = np.array([1.0 if term in SUPPLY else -1.0 for term in POWER_TERMS])
NOISES = np.array([0.8, -1.3])


def data_of(effects, altitude=-HEIGHT):
    """Mapping of the file of `sbs` with some effects, with two rotors that are not alike."""
    options, rotor, ground = {"elements": 3}, {}, {"altitude": altitude}
    for effect in effects:
        options |= OPTIONS.get(effect, {})
        rotor |= ROTOR.get(effect, {})
        ground |= GROUND.get(effect, {})
    places = [{"hub": [0.02, -0.645, 0.066]}, {"hub": [0.0, 0.66, 0.05]}]
    data = aircraft_data(options=options, every_rotor=rotor, rotors=places)
    return data | {"ground": ground} if len(ground) > 1 else data


SINKING = (1.5, -1.0, 6.0)  # m/s


def instant(aircraft, rng, velocity=SINKING):
    """State near the ground that descends, swashplate angles, azimuths and the rows of gusts of the rotors."""
    x = random_state(aircraft, rng, 0.3)
    x[S.POSITION : S.ATTITUDE] = 0.4, -0.3, 0.0
    x[S.ATTITUDE : S.VELOCITY] = np.array([1.0, 0.02, -0.015, 0.3]) / np.linalg.norm([1.0, 0.02, -0.015, 0.3])
    x[S.VELOCITY : S.RATES] = velocity
    deflections = np.zeros(aircraft.layout.size - len(x))
    deflections[:] = rng.normal(scale=2e-3, size=len(deflections))
    for j in range(2):
        x[aircraft.layout.inflow(j).start] = 0.06 + 0.005 * j
    swash, psi = rng.normal(scale=0.1, size=(2, 3)), rng.uniform(0, 6, 2)
    return np.concatenate([x, deflections]), swash, psi, rng.normal(scale=1.5, size=(2, 3, 3))


def derivative(model, x, swash, psi, effects, gusts, noise=NOISES):
    """Derivative of a state with the noise of rings and gusts where the effects have them."""
    if "ring" in effects:
        model.engine.work.ring[NOISE] = noise[:, None]
    wind = np.concatenate([CALM, gusts.ravel()]) if "gusts" in effects else CALM
    return model.derivative(x, swash, psi, wind)


@pytest.mark.parametrize("pair", PAIRS, ids="+".join)
def test_two_effects_together(pair):
    """As the plain reference has it, mirrored as the image has it, and with no power from nowhere."""
    aircraft, rng = Aircraft.from_dict(data_of(pair)), np.random.default_rng(len("".join(pair)))
    model = Model(aircraft)
    x, swash, psi, gusts = instant(aircraft, rng)
    found = derivative(model, x, swash, psi, pair, gusts)
    local = [(gust[0], np.stack([gust[1], gust[2], 0 * gust[0]], axis=1)) for gust in gusts]
    noise = NOISES if "ring" in pair else None
    expected, _ = plain_derivative(
        aircraft, x, swash, psi, CALM, local_air=local if "gusts" in pair else None, ring_noise=noise
    )
    scale = np.maximum(np.abs(expected), 1e-3 * np.abs(expected).max())
    assert (np.abs(found[: len(expected)] - expected) / scale).max() < 1e-7  # the rest are the deflections of skids

    image = Model(Aircraft.from_dict(mirrored_data(data_of(pair))))
    turned = gusts * POLAR * np.array([1.0, 1.0, -1.0])[:, None]  # change along y
    seen = derivative(image, mirrored_state(x, aircraft.layout), mirrored_swash(swash), psi, pair, turned)
    np.testing.assert_allclose(seen, mirrored_state(found, aircraft.layout), rtol=1e-9, atol=1e-8 * np.abs(found).max())

    if "gusts" not in pair:  # whose work is not among the terms
        rows = power_balance(model.engine, *(np.array([own]) for own in (x, swash, psi, CALM)), noise=noise_row(pair))
        assert abs(rows[0] @ SIGNS) < 1e-11 * np.abs(rows).max()


def noise_row(effects):
    """Noise as `power_balance` takes it."""
    return NOISES[None] if "ring" in effects else None


@pytest.mark.parametrize("pair", PAIRS, ids="+".join)
def test_two_effects_are_continuous(pair):
    """From a climb through the ring into the windmill: steps of a quarter make changes of 0.6 at most."""
    aircraft, rng = Aircraft.from_dict(data_of(pair)), np.random.default_rng(3)
    model = Model(aircraft)
    x, swash, psi, gusts = instant(aircraft, rng)
    x[S.RATES : S.BODY_SIZE] = 0.0
    changes = []
    for count in (250, 1000):
        found = []
        for sinking in np.linspace(-2.0, 18.0, count):
            x[S.VELOCITY : S.RATES] = 2.4, -1.0, sinking
            found.append(derivative(model, x, swash, psi, pair, gusts)[S.VELOCITY :])
        changes.append(np.abs(np.diff(found, axis=0)).max(axis=0))
    jumps = changes[1] > 0.6 * changes[0] + 1e-9 * np.abs(found).max(axis=0)
    assert not jumps.any(), np.array(aircraft.layout.names[S.VELOCITY :])[jumps]


def without_inflow(aircraft, x):
    """Take the inflow of every rotor away, and with it its wake."""
    for j in range(2):
        x[aircraft.layout.inflow(j)] = 0.0


LIMITS = ("wakes", "ground effect", "skids", "ring", "gusts")
ORDERED = [pair for both in PAIRS for pair in (both, both[::-1]) if pair[0] in LIMITS]


@pytest.mark.parametrize(("effect", "other"), ORDERED, ids=map("+".join, ORDERED))
def test_an_effect_vanishes_in_its_limit_beside_any_other(effect, other):
    """No inflow, ground far away, a climb without ring, gusts of zero: what the other effect alone does is left."""
    altitude = -FAR if effect in GROUND else -HEIGHT
    first = Aircraft.from_dict(data_of((other,), altitude))
    if effect == "ring":  # beside it the same inflow factor, without the law of descent
        first = first.with_value("rotors.induced_power_factor", 1.1)
    second = Aircraft.from_dict(data_of((effect, other), altitude))
    x, swash, psi, gusts = instant(first, np.random.default_rng(5), (1.5, -1.0, -6.0) if effect == "ring" else SINKING)
    if effect == "wakes":
        without_inflow(first, x)
    grown = np.concatenate([x, np.zeros(second.layout.size - len(x))])
    alone = derivative(Model(first), x, swash, psi, (other,), gusts)
    together = derivative(Model(second), grown, swash, psi, (effect, other), gusts * (effect != "gusts"))
    np.testing.assert_allclose(together[: len(alone)], alone, rtol=1e-9, atol=1e-9 * np.abs(alone).max())
    assert not together[len(alone) :].any()
