"""Pilot controls to swashplate angles (paper section 2.1.1; theory.md section 4)."""

from sbs_sim.lanes import as_lanes, as_records, rounded
from sbs_sim.model.kernel import entry, kernel


@kernel
def mix(mixing, controls, first, swash):
    """Swashplate angles of pilot controls, which begin at index `first`: mixing @ controls."""
    for i in range(mixing.shape[0]):
        angle = rounded(mixing[i, 0] * controls[first])
        for n in range(1, mixing.shape[1]):
            angle = angle + mixing[i, n] * controls[first + n]
        swash[i] = angle


@entry
def mixed(mixing, controls, like, swash):
    """Swashplate angles, shape (3 n_rotors, n), of pilot controls, (n_controls, n); `like` are records of n lanes."""
    records = as_records(like)
    mix(mixing, as_lanes(controls, records), 0, as_lanes(swash, records))
