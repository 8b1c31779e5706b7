"""Loads on a body that does not accelerate: for the two nested loops of trim (theory.md section 8)."""

from sbs_sim.lanes import Vector, as_lanes, cross, rounded, spread, zeros_like
from sbs_sim.model.dynamics import (
    add_lag_of_flap,
    body_motion,
    in_lanes,
    memory_in_lanes,
    set_acceleration,
    set_body_rates,
    set_hub_loads,
    set_known_loads,
    set_rotor_rates,
    solve_blades,
    solve_blades_alone,
    with_hub_loads,
)
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.state import set_vector
from sbs_sim.model.teeter import hold_coning


@entry
def steady_balance(model, x, swash, psi, wind, work, dx, imbalance):
    """What the model gives while the body does not accelerate.

    The blades are taken twice. As they move on a hub in steady motion (U' = om' = 0), they give the rates of the
    rotors. Held on constant multiblade coordinates, with the steady accelerations
    beta'' = Omega^2 (a1 cos psi + b1 sin psi), they give the loads on the body. Both averages over the azimuth vanish
    at a trim, but for products of the vibrations of body and blades.

    Parameters
    ----------
    model, x, swash, psi, wind, work : see `sbs_sim.model.dynamics.derivative`
        Afterwards `work.loads` holds the loads of the blades on constant coordinates, `work.acceleration` the specific
        force of the c.g. in steady motion, om x U - g [m/s^2], and no angular acceleration.
    dx : ndarray, shape (size, n)
        Output: rates of the rotor states, and of position and attitude; U' and om' are zero.
    imbalance : ndarray, shape (6, n)
        Output: force [N] and moment about the c.g. [N m], body axes, that are left to accelerate the aircraft.
    """
    aircraft, memory = in_lanes(model), memory_in_lanes(work)
    like = aircraft.air[0]
    given, rates, left = as_lanes(x, like), as_lanes(dx, like), as_lanes(imbalance, like)
    for i in range(given.shape[0]):
        memory.state[i] = given[i]
    flight = body_motion(aircraft, memory.state, as_lanes(wind, like))
    loads = set_known_loads(aircraft, memory, flight, as_lanes(swash, like), as_lanes(psi, like))
    steady = cross(flight.omega, flight.velocity) - flight.gravity
    set_acceleration(memory, steady, Vector(0.0, 0.0, 0.0))
    if aircraft.switches[0].complete_coupling == 1:
        solve_blades(aircraft, memory)
        if aircraft.switches[0].teetering == 1:
            hold_coning(aircraft, memory)
    else:
        solve_blades_alone(aircraft, memory)
    set_body_rates(memory, flight, rates)
    set_rotor_rates(aircraft, memory, rates)
    hold_coordinates(aircraft, memory)
    if aircraft.switches[0].offsets == 1:
        add_lag_of_flap(aircraft, memory, 1.0)
    set_hub_loads(aircraft, memory)
    total, body = with_hub_loads(aircraft, memory, loads), aircraft.body[0]
    set_vector(left, 0, total.force - steady * body.mass)
    set_vector(left, 3, total.moment - cross(body.first_moment, steady))


@kernel
def hold_coordinates(aircraft, memory):
    """Accelerations of the blades in the rotating frame on multiblade coordinates that do not change."""
    indices = aircraft.indices
    for r in range(aircraft.blades.shape[0]):
        blade, terms = aircraft.blades[r], memory.terms[r]
        if blade.harmonics == 0:  # two blades move with their own accelerations
            continue
        flap = steady_acceleration(memory.state, indices.flap, blade, terms)
        lag = steady_acceleration(memory.state, indices.lag, blade, terms)
        terms.flap_acceleration, terms.lag_acceleration = flap, lag * blade.lead_lag


@kernel
def steady_acceleration(x, angles, blade, terms):
    """Acceleration of blades on constant coordinates: sum of (n Omega)^2 (a_n cos n psi + b_n sin n psi)."""
    acceleration = zeros_like(terms.cosine)
    cosine, sine = terms.cosine, terms.sine
    cn, sn = cosine, sine
    for n in range(1, blade.harmonics + 1):
        harmonic = rounded(n * blade.rotor_speed)
        a, b = spread(x, angles[2 * n - 1], blade.quad, blade), spread(x, angles[2 * n], blade.quad, blade)
        acceleration = acceleration + harmonic * harmonic * (a * cn + b * sn)
        cn, sn = cn * cosine - sn * sine, sn * cosine + cn * sine
    return acceleration
