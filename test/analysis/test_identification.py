"""Excitations, and frequency responses identified from them, against systems with responses in closed form."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from sbs_sim import Aircraft, linearize
from sbs_sim.analysis.identification import identify
from sbs_sim.analysis.spectra import averages, spectra
from sbs_sim.errors import IdentificationError
from sbs_sim.flight.excitation import Chirp, Excitation, Multisine, multisines
from sbs_sim.flight.signals import Signals
from sbs_sim.pilot.hover_hold import HoverHold, HoverModel, design
from sbs_sim.pilot.piloted_flight import simulate_with_pilot

TICK = 0.02
NATURAL, DAMPING = 3.0, 0.5
DB = 20.0 / math.log(10.0)


def second_order(frequencies, natural=NATURAL, damping=DAMPING, gain=1.0):
    """Gain w^2 / (s^2 + 2 zeta w s + w^2) on the imaginary axis."""
    return gain * natural**2 / (natural**2 - frequencies**2 + 2j * damping * natural * frequencies)


def sampled_second_order(natural=NATURAL, damping=DAMPING, gain=1.0):
    """Its matrices from sample to sample for an input that is held."""
    a = np.array([[0.0, 1.0], [-(natural**2), -2.0 * damping * natural]])
    both = np.zeros((3, 3))
    both[:2, :2], both[1, 2] = a, gain * natural**2
    both = expm(TICK * both)
    return both[:2, :2], both[:2, 2]


def through(values, **system):
    """Output of the second-order system for a held input."""
    a, b = sampled_second_order(**system)
    state, found = np.zeros(2), np.empty(len(values))
    for i, value in enumerate(values):
        found[i] = state[0]
        state = a @ state + b * value
    return found


def signals(**values):
    """Signals of which those that begin with u or r are held."""
    held = frozenset(name for name in values if name[0] in "ur")
    return Signals(TICK, values, dict.fromkeys(values, "rad"), held)


TIME = np.arange(0.0, 90.0, TICK)
CHIRP = Chirp("u", 1.0, 0.35, 14.0, 80.0, begin=5.0)
ASKED = np.geomspace(0.5, 12.0, 24)


# -- excitations -----------------------------------------------------------------------------------------------------


def test_a_chirp_is_within_its_times_and_rises_by_octaves_of_equal_length():
    chirp = Chirp("u", 0.5, 1.0, 16.0, 40.0, begin=2.0, fade=3.0)
    time = np.arange(0.0, 50.0, 1e-3)
    values = chirp.at(time)
    assert np.all(values[(time <= 2.0) | (time >= 42.0)] == 0.0)
    assert 0.49 < np.abs(values[(time > 5.0) & (time < 39.0)]).max() <= 0.5
    crossings = time[:-1][(values[:-1] < 0.0) & (values[1:] >= 0.0)]
    frequency = 2.0 * math.pi / np.diff(crossings)
    middle = 0.5 * (crossings[1:] + crossings[:-1])
    expected = 16.0 ** ((middle - 2.0) / 40.0)
    assert np.abs(frequency / expected - 1.0)[2:-2].max() < 0.01
    assert Chirp("u", 0.5, 16.0, 1.0, 40.0).band == (1.0, 16.0)


def test_the_phases_of_schroeder_keep_the_peak_low():
    """With equal amplitudes his peak factor is near 1.2 (relative to that of a sine); equal phases give sqrt(N)."""
    sine = Multisine("u", 1.0, tuple(range(1, 32)), 20.0)
    assert sine.peak_factor < 1.35
    assert np.abs(sine.at(np.linspace(2.0, 58.0, 40_000))).max() == pytest.approx(1.0, rel=0.01)


def test_multisines_of_several_controls_are_orthogonal():
    parts = multisines({"u1": 0.1, "u2": 0.2, "u3": 0.3}, 0.5, 6.0, 30.0)
    assert not set(parts[0].harmonics) & set(parts[1].harmonics)
    time = np.arange(30.0, 60.0, 0.01)
    rows = np.array([part.at(time) for part in parts])
    products = rows @ rows.T
    assert np.abs(products - np.diag(np.diag(products))).max() < 1e-9 * products[0, 0]


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Chirp("u", math.nan, 1.0, 2.0, 10.0), "amplitude = nan: allowed are 0 to 1e"),
        (lambda: Chirp("u", 1.0, 1.0, 2000.0, 10.0), "high = 2000.0: allowed are 0.001 to 1000 rad/s"),
        (lambda: Chirp("u", 1.0, 1.0, 2.0, 3.0), "duration = 3.0: allowed are 6.28319 to 3600 s"),
        (lambda: Chirp("u", 1.0, 1.0, 1.0, 30.0), "high = 1: allowed is another frequency than low"),
        (lambda: Chirp("u", 1.0, 1.0, 2.0, 30.0, fade=20.0), "fade = 20.0: allowed are 0 to 15 s"),
        (lambda: Multisine("u", 1.0, (3, 3), 10.0), "harmonics: allowed are one or more rising integers"),
        (lambda: multisines({"u": 1.0, "v": 1.0}, 1.0, 2.0, 10.0), "2 harmonics for 2 controls"),
    ],
)
def test_an_excitation_out_of_range_is_refused(make, text):
    with pytest.raises(IdentificationError, match=text.replace("(", r"\(")):
        make()


def test_what_the_aircraft_cannot_follow_is_refused():
    aircraft = Aircraft.load("sbs")
    rest = aircraft.resting_controls.copy()
    rest[0] = 0.15
    name = "longitudinal_cyclic"
    _, high = aircraft.controls[aircraft.control_names.index(name)].range
    with pytest.raises(IdentificationError, match="control = 'pedal': allowed are collective"):
        Excitation(aircraft, [Chirp("pedal", 0.01, 1.0, 10.0, 20.0)])
    with pytest.raises(IdentificationError, match=rf"excitation: at .* s: {name} = .*: allowed are"):
        Excitation(aircraft, [Chirp(name, 1.1 * high, 0.5, 0.6, 20.0)]).check(rest)
    with pytest.raises(IdentificationError, match=r"moves at .* deg/s: its actuator allows"):
        Excitation(aircraft, [Chirp(name, 0.5 * high, 50.0, 300.0, 20.0)]).check(rest)
    small = Excitation(aircraft, [Chirp(name, 0.01, 0.5, 30.0, 20.0), Chirp("collective", 0.01, 0.5, 30.0, 20.0)])
    controls = small.around(rest)
    assert np.array_equal(controls(0.0), rest)
    assert small.control_names == ("collective", name)
    assert controls(7.0) - rest == pytest.approx(small.history(7.0)[0], abs=1e-15)


# -- estimates -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["welch", "chirp_z"])
def test_the_response_of_a_second_order_system_is_found(method):
    """Without noise: only what windows leave, 0.25 dB and 2.5 deg."""
    driven = CHIRP.at(TIME)
    found = identify(signals(u=driven, y=through(driven)), ["u"], ["y"], frequencies=ASKED, method=method)["u", "y"]
    ratio = found.response.response / second_order(ASKED)
    assert found.coherence.min() > 0.95
    assert found.valid_range == (pytest.approx(0.5), pytest.approx(12.0))
    assert np.abs(DB * np.log(np.abs(ratio))).max() < 0.25
    assert np.abs(np.degrees(np.angle(ratio))).max() < 2.5
    assert found.response.phase[-1] == pytest.approx(np.angle(second_order(ASKED[-1])), abs=0.05)


def test_the_random_error_is_that_of_repeated_flights():
    """Many flights with white noise on the output: the scatter of gain and phase is the one that is printed."""
    rng = np.random.default_rng(4)
    driven = through(rng.standard_normal(len(TIME)), natural=8.0, damping=1.0)
    clean = through(driven)
    asked, departures, errors = np.geomspace(1.1, 5.0, 8), [], []
    for _ in range(25):
        noisy = signals(u=driven, y=clean + 0.25 * rng.standard_normal(len(TIME)))
        found = identify(noisy, ["u"], ["y"], frequencies=asked, windows=[17.0])["u", "y"]
        departures.append(found.response.response / second_order(asked) - 1.0)
        errors.append(found.random_error)
    scatter = np.std(np.array(departures), axis=0) / math.sqrt(2.0)
    printed = np.mean(errors, axis=0)
    assert found.random_error.min() > 0.05
    assert scatter.mean() / printed.mean() == pytest.approx(1.0, abs=0.15)
    # Bendat and Piersol, eq. 9.90: of one input the error follows from coherence and averages
    gamma = found.coherence
    assert found.random_error == pytest.approx(np.sqrt((1.0 - gamma) / (2.0 * found.averages * gamma)), rel=1e-9)


def test_overlapping_segments_count_as_welch_has_them():
    """His example: with half overlap Hann's window has a correlation of 1/6 with the next segment."""
    assert averages(100_000, 400, 200) == pytest.approx(500.0 / (1.0 + 2.0 / 36.0), rel=1e-3)
    assert averages(1000, 100, 100) == pytest.approx(10.0)


def test_the_spectrum_of_white_noise_is_its_variance_over_the_band():
    noise = np.random.default_rng(0).standard_normal((1, 40_000))
    for method in ("welch", "chirp_z"):
        found = spectra(noise, TICK, np.geomspace(5.0, 100.0, 40), 10.0, method)
        assert found.matrices[:, 0, 0].real.mean() == pytest.approx(2.0 * TICK, rel=0.05)


def correlated_inputs(rng, share=0.8):
    """Two inputs of which the second follows the first in part."""
    first = through(rng.standard_normal(len(TIME)), natural=6.0, damping=1.0)
    second = share * first + through(rng.standard_normal(len(TIME)), natural=6.0, damping=1.0)
    return first, second


def test_effects_of_correlated_inputs_are_separated():
    first, second = correlated_inputs(np.random.default_rng(1))
    output = through(first) + through(second, natural=1.5, gain=2.0)
    both = signals(u1=first, u2=second, y=output)
    found = identify(both, ["u1", "u2"], ["y"], frequencies=ASKED)
    alone = identify(both, ["u1"], ["y"], frequencies=ASKED)["u1", "y"]
    low = ASKED < 6.0
    for name, expected in (("u1", second_order(ASKED)), ("u2", second_order(ASKED, natural=1.5, gain=2.0))):
        ratio = found[name, "y"].response.response / expected
        spread = np.abs(ratio - 1.0) / found[name, "y"].random_error
        assert math.sqrt(np.mean(spread[low] ** 2) / 2.0) < 1.5
        assert np.abs(ratio - 1.0)[low].mean() < 0.15
        assert found[name, "y"].coherence[low].min() > 0.5
        assert found[name, "y"].multiple_coherence[low].min() > 0.9
    assert found["u1", "y"].conditioned_on == ("u2",)
    low_gain = ASKED < 1.0  # there the second adds 0.8 times 2 to the 1 of the first
    assert np.abs(alone.response.response[low_gain] / second_order(ASKED[low_gain])).mean() > 2.0
    assert np.array_equal(alone.ordinary_coherence, alone.coherence) or alone.ordinary_coherence == pytest.approx(
        alone.coherence, abs=1e-9
    )
    assert np.all(found["u1", "y"].ordinary_coherence < found["u1", "y"].multiple_coherence + 1e-12)


def test_what_has_no_response_has_no_coherence():
    """What noise makes of it is one over the number of independent segments, on average."""
    noise = np.random.default_rng(5).standard_normal((2, len(TIME)))
    found = identify(
        signals(u=noise[0], y=noise[1]), ["u"], ["y"], frequencies=np.geomspace(4.0, 60.0, 40), windows=[10]
    )
    found = found["u", "y"]
    assert found.coherence.mean() == pytest.approx(1.0 / found.averages[0], rel=0.3)
    assert found.coherence.max() < 0.4
    assert found.valid_range is None


def feedback_flight(rng, noise):
    """An unstable first-order system under u = r - 3 y, whose output is disturbed: y' = y + 2 u + w."""
    a, b = math.exp(TICK), 2.0 * (math.exp(TICK) - 1.0)
    reference = Chirp("r", 1.0, 0.35, 14.0, 80.0, begin=5.0).at(TIME)
    gust = noise * through(rng.standard_normal(len(TIME)), natural=4.0, damping=0.7)
    state, inputs, outputs = 0.0, np.empty(len(TIME)), np.empty(len(TIME))
    for i, asked in enumerate(reference):
        outputs[i] = state
        inputs[i] = asked - 3.0 * state
        state = a * state + b * (inputs[i] + gust[i])
    return signals(u=inputs, y=outputs, r=reference)


def test_excitations_as_instruments_take_the_bias_of_feedback_away():
    """The direct estimate leans towards -1/3, minus the inverse of the controller; that by the excitation does not."""
    asked = np.geomspace(0.9, 6.0, 10)
    expected = 2.0 / (1j * asked - 1.0)
    rng, found = np.random.default_rng(3), {"direct": [], "joint": []}
    for _ in range(12):
        flown = feedback_flight(rng, 1.0)
        for kind, references in (("direct", []), ("joint", ["r"])):
            one = identify(flown, ["u"], ["y"], references=references, frequencies=asked, windows=[15.0])["u", "y"]
            assert one.method == kind
            found[kind].append([one.response.response / expected, one.random_error])
    (direct, _), (joint, error) = (np.moveaxis(np.array(own), 1, 0) for own in found.values())
    scatter = np.sqrt(np.mean(np.abs(joint - 1.0) ** 2 / np.abs(error) ** 2) / 2.0)
    assert scatter == pytest.approx(1.0, abs=0.2)  # the printed error is the one that there is
    assert np.abs(joint.mean(axis=0) - 1.0).max() < 0.15
    assert np.abs(direct.mean(axis=0))[:6].max() < 0.8  # -1/3 would be a sixth of the response at low frequencies


# -- the aircraft ----------------------------------------------------------------------------------------------------

EXCITED = ("lateral_cyclic", "differential_longitudinal_cyclic")


@pytest.fixture(scope="module")
def hover():
    """Linear model of hover, and signals of a flight under the hover hold with chirps on roll and yaw."""
    aircraft = Aircraft.load("sbs")
    model = linearize(aircraft)
    chirps = [Chirp(name, math.radians(0.3), 3.0, 25.0, 14.0, begin=1.0 + 15.0 * i) for i, name in enumerate(EXCITED)]
    excitation = Excitation(aircraft, chirps)
    excitation.check(model.trim.controls)
    pilot = excitation.with_pilot(HoverHold(design(HoverModel.of(model))).controls)
    return model, Signals.of(aircraft, simulate_with_pilot(aircraft, model.trim, pilot, 31.0), excitation)


@pytest.mark.parametrize(
    ("control", "output"),
    [
        ("lateral_cyclic", "p"),
        ("lateral_cyclic", "phi"),
        ("lateral_cyclic", "r"),
        ("differential_longitudinal_cyclic", "r"),
    ],
)
def test_what_is_identified_is_the_linear_model(hover, control, output):
    """For small inputs: within twice the printed random error, or 0.5 dB and 3 deg where that is smaller."""
    model, flown = hover
    asked = np.geomspace(4.0, 20.0, 16)
    references = [f"excitation_{name}" for name in EXCITED]
    found = identify(flown, EXCITED, [output], references=references, frequencies=asked)[control, output]
    gain, phase = found.departure(model.frequency_response(control, output, asked))
    assert found.valid.all()
    assert np.all(np.abs(gain) <= np.maximum(2.0 * found.gain_error_db, 0.5))
    assert np.all(np.abs(phase) <= np.maximum(2.0 * found.phase_error_deg, 3.0))
    high = asked > 6.0
    assert np.abs(gain)[high].max() < 0.3
    assert np.abs(phase)[high].max() < 2.0
    assert found.gain_error_db[high].max() < 0.5


def test_signals_have_the_names_of_linear_models(hover):
    model, flown = hover
    known = {*model.state_names, *model.output_names}
    assert known - set(flown.values) <= {name for name in known if name.startswith("hub_")}
    units = dict(zip((*model.state_names, *model.output_names), (*model.state_units, *model.output_units), strict=True))
    assert {name: unit for name, unit in flown.units.items() if name in known} == {
        name: units[name] for name in flown.values if name in known
    }
    assert flown.values["specific_force_z"].mean() == pytest.approx(-9.81, abs=0.02)
    assert flown.values["climb_rate"] == pytest.approx(-flown.values["w"], abs=0.01)
    assert set(flown.excitations) == {f"excitation_{name}" for name in EXCITED}
    part = flown.between(5.0, 10.0)
    assert part.duration == pytest.approx(5.0)
    assert np.array_equal(part.values["q"], flown.values["q"][500:1000])


# -- refusals --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"inputs": ["v"]}, "inputs = 'v': allowed are u, y"),
        ({"outputs": ["y", "y"]}, "outputs: allowed are 1 to 20 different names"),
        ({"references": ["u", "y"]}, "references: 2 for 1 inputs"),
        ({"windows": [300.0]}, "windows = 300.0: allowed are 0.32 to 60 s"),
        ({"frequencies": [3.0, 2.0]}, "frequencies: allowed are one or more rising numbers"),
        ({"frequencies": [3.0, 200.0]}, "frequencies = 200.0: allowed are 0.0001 to 157.08 rad/s"),
        ({"method": "magic"}, "method = 'magic': allowed are welch, chirp_z"),
    ],
)
def test_what_cannot_be_identified_is_refused(change, text):
    driven = CHIRP.at(TIME)
    arguments = {"inputs": ["u"], "outputs": ["y"], **change}
    with pytest.raises(IdentificationError, match=text):
        identify(signals(u=driven, y=through(driven)), arguments.pop("inputs"), arguments.pop("outputs"), **arguments)


def test_inputs_that_do_not_move_or_move_alike_are_refused():
    driven = CHIRP.at(TIME)
    output = through(driven)
    with pytest.raises(IdentificationError, match="u does not move"):
        identify(signals(u=0.0 * driven, y=output), ["u"], ["y"])
    with pytest.raises(IdentificationError, match="the inputs move alike"):
        identify(signals(u1=driven, u2=2.0 * driven, y=output), ["u1", "u2"], ["y"])


def test_signals_that_are_not_finite_or_not_equal_are_refused():
    bad = CHIRP.at(TIME)
    bad[100] = math.nan
    with pytest.raises(IdentificationError, match="u at 2 s: allowed are finite numbers"):
        signals(u=bad)
    with pytest.raises(IdentificationError, match="signals of 90, 100 samples"):
        signals(u=np.zeros(100), y=np.zeros(90))
