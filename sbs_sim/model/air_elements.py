"""Air at every blade element where it is, in place of that at the hubs and its gradients (theory.md section 7.8).

Positions are worked out with the blades in the lanes, their air number by number: every element has cells of the field
of its own.
"""

from sbs_sim.lanes import as_lanes, as_records, transposed
from sbs_sim.model import state as S
from sbs_sim.model.air_rows import AT_HUB, gust_of_blade
from sbs_sim.model.blade import blade_basis, to_blade, to_body
from sbs_sim.model.dynamics import blade_pose, in_lanes
from sbs_sim.model.frames import rotation
from sbs_sim.model.kernel import kernel
from sbs_sim.model.state import attitude_at


@kernel
def set_blades(model, x, psi, space):
    """Set the state with a zero behind it, and the azimuths of the rotors, also of those that a drive turns."""
    rotors, drives = as_records(model.rotors), as_records(model.drives)
    given, state = as_lanes(x, rotors), as_lanes(space.state, rotors)
    start, azimuths = as_lanes(psi, rotors), as_lanes(space.azimuths, rotors)
    for i in range(given.shape[0]):
        state[i] = given[i]
    for j in range(rotors.shape[0]):
        azimuths[j] = start[j]
        if rotors[j].drive >= 0:
            turned = state[drives[rotors[j].drive].unseen_index + S.AZIMUTH]
            azimuths[j] = start[j] + rotors[j].gear * turned


@kernel
def pose_of(model, space, r):
    """Basis of a register of blades."""
    aircraft = in_lanes(model)
    state, azimuths = as_lanes(space.state, aircraft.rotors), as_lanes(space.azimuths, aircraft.rotors)
    return blade_basis(aircraft.blades[r], blade_pose(aircraft, state, aircraft.blades[r], azimuths))


@kernel
def set_element_sites(model, space, r, basis):
    """Set where the elements of a register of blades are from the c.g., NED: on the pitch axis."""
    rotors, blades = as_records(model.rotors), as_records(model.blades)
    blade, elements = blades[r], as_records(model.elements)[blades[r].elements]
    to_earth, out = rotation(attitude_at(as_lanes(space.state, rotors))), as_lanes(space.elements, blades)
    hinge = basis.lag_hinge + basis.flap_hinge + basis.normal * blade.axis_height
    start = to_earth @ (blade.hub + to_body(blade, basis, hinge))
    along = to_earth @ to_body(blade, basis, basis.span)
    for i in range(elements.shape[0]):
        S.set_vector(out[r, i], 0, start + along * elements[i].span)


@kernel
def turn_elements(model, space, air, r, basis):
    """Turn velocities less those at the c.g., NED, into those less the ones at the hub, along (y, t, u)."""
    aircraft = in_lanes(model)
    blade, rows = aircraft.blades[r], as_lanes(air, aircraft.rotors)
    to_body_axes = transposed(rotation(attitude_at(as_lanes(space.state, aircraft.rotors))))
    to_hub, out = transposed(blade.axes), as_lanes(space.elements, aircraft.blades)
    at_hub = gust_of_blade(aircraft, rows, blade, AT_HUB)
    for i in range(out.shape[1]):
        found = to_hub @ (to_body_axes @ S.vector_at(out[r, i], 0))
        S.set_vector(out[r, i], 0, to_blade(blade, basis, found - at_hub))
