"""Teetering rotors: one flap hinge for all blades, whose coning is locked (theory.md section 3.4).

Flap accelerations of blades that do not know of each other have a mean. The moment that the hub must exert on every
blade, to make that mean what it has to be, is eliminated like a hinge of eq. (5.8).
"""

from sbs_sim.lanes import Matrix, Vector, add_to_quads, rounded, select, spread
from sbs_sim.model.kernel import kernel
from sbs_sim.model.offset import inverse_flap_inertia


@kernel
def lock_coning(aircraft, memory):
    """Take the coning of teetering rotors out of the sums over their blades, eq. (3.11)."""
    for r in range(aircraft.blades.shape[0]):
        blade, terms = aircraft.blades[r], memory.terms[r]
        inverse = inverse_flap_inertia(aircraft, memory, r)
        force, moment = terms.flap_column_force, terms.flap_column_moment
        free = (times(force, inverse), times(moment, inverse), rounded(inverse * terms.flap_moment))
        add_to_quads(memory.coning, blade.quad, blade.starts_quad, "force", (force, moment, *free, inverse))
    for j in range(aircraft.rotors.shape[0]):
        rotor = aircraft.rotors[j]
        if rotor.teetering == 1:
            zero = Vector(0.0, 0.0, 0.0)
            force, moment, force_share, moment_share, flap = zero, zero, zero, zero, 0.0
            for quad in range(rotor.first_quad, rotor.first_quad + rotor.quads):
                own = memory.coning[quad]
                force, moment, flap = force + own.force, moment + own.moment, flap + own.flap
                force_share, moment_share = force_share + own.force_share, moment_share + own.moment_share
            share = rotor.inverse_blades
            if aircraft.switches[0].offsets == 1:  # blades whose A_1 differ
                factor = 1.0 / (share * inverse_sum(memory, rotor))
                force, moment = times(force_share, factor), times(moment_share, factor)
            added = rounded(share * flap) - coning_acceleration(rotor, memory.state)
            force_share, moment_share = times(force_share, share), times(moment_share, share)
            take_out(memory.totals[j], force, moment, force_share, moment_share, added)
            take_out(memory.totals[aircraft.rotors.shape[0]], force, moment, force_share, moment_share, added)


@kernel
def inverse_sum(memory, rotor):
    """Sum of 1 / A_1 over the blades of a rotor."""
    found = 0.0
    for quad in range(rotor.first_quad, rotor.first_quad + rotor.quads):
        found = found + memory.coning[quad].inverse
    return found


@kernel
def take_out(total, force, moment, force_share, moment_share, added):
    """Less hinge inertia, and more load, of what flaps together: c c^T / (N_b A_1) of the sum c of the columns."""
    masses, rows, inertias = total.hinge_mass, total.hinge_coupling, total.hinge_inertia
    take(masses, force_share, force)
    take(inertias, moment_share, moment)
    total.hinge_coupling = Matrix(
        rows.x - times(force, moment_share.x),
        rows.y - times(force, moment_share.y),
        rows.z - times(force, moment_share.z),
    )
    total.force = total.force + times(force, added)
    total.moment = total.moment + times(moment, added)


@kernel
def take(field, a, b):
    """Subtract the elements xx, yy, zz, xy, yz, zx of a b^T, which is symmetric."""
    field[0], field[1], field[2] = field[0] - a.x * b.x, field[1] - a.y * b.y, field[2] - a.z * b.z
    field[3], field[4], field[5] = field[3] - a.y * b.x, field[4] - a.z * b.y, field[5] - a.x * b.z


@kernel
def hold_coning(aircraft, memory):
    """Set the mean flap acceleration of teetering rotors, once that of every blade for itself is set."""
    for r in range(aircraft.blades.shape[0]):
        blade, flap = aircraft.blades[r], memory.terms[r].flap_acceleration
        add_to_quads(memory.means, blade.quad, blade.starts_quad, "flap", (flap, flap, flap, flap))
        if aircraft.switches[0].offsets == 1:
            inverse = memory.pitching[r].inverse_flap_inertia
            add_to_quads(memory.coning, blade.quad, blade.starts_quad, "inverse", (inverse,))
    for j in range(aircraft.rotors.shape[0]):
        rotor = aircraft.rotors[j]
        memory.coning_change[j] = 0.0 * rotor.inverse_blades
        if rotor.teetering == 1:
            mean = 0.0
            for quad in range(rotor.first_quad, rotor.first_quad + rotor.quads):
                mean = mean + memory.means[quad].flap
            memory.coning_change[j] = coning_acceleration(rotor, memory.state) - rotor.inverse_blades * mean
            if aircraft.switches[0].offsets == 1:
                memory.coning_change[j] = memory.coning_change[j] / (rotor.inverse_blades * inverse_sum(memory, rotor))
    for r in range(aircraft.blades.shape[0]):
        blade, terms = aircraft.blades[r], memory.terms[r]
        change = spread(memory.coning_change, aircraft.indices.azimuth, blade.quad, blade)
        if aircraft.switches[0].offsets == 1:
            change = rounded(change * memory.pitching[r].inverse_flap_inertia)
        terms.flap_acceleration = terms.flap_acceleration + select(blade.mass > 0.0, change, 0.0)


@kernel
def coning_acceleration(rotor, x):
    """a_0'' of a coning that is where it has to be, or goes there without overshoot, eq. (3.10)."""
    speed = rotor.inflow_speed
    missing, rate = rotor.flap_rest - x[rotor.flap], x[rotor.flap_rate]
    return rounded(speed * (speed * missing - 2.0 * rate))


@kernel
def times(vector, factor):
    """Vector times a number, rounded."""
    return Vector(factor * vector.x, factor * vector.y, factor * vector.z)
