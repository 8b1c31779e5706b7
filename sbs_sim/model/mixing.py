"""Pilot controls to swashplate angles (paper section 2.1.1; theory.md section 4)."""

from sbs_sim.lanes import as_lanes, as_records
from sbs_sim.model.kernel import entry, kernel


@kernel
def mix(rigging, controls, first, swash):
    """Swashplate angles of pilot controls, which begin at index `first`; the last column of the rigging is constant."""
    count = rigging.shape[1] - 1
    for i in range(rigging.shape[0]):
        angle = rigging[i, count] + rigging[i, 0] * controls[first]
        for n in range(1, count):
            angle = angle + rigging[i, n] * controls[first + n]
        swash[i] = angle


@entry
def mixed(rigging, controls, like, swash):
    """Swashplate angles, shape (3 n_rows, n), of pilot controls, (n_controls, n); `like` are records of n lanes.

    The rigging has the shape (3 n_rows, n_controls + 1): the angles are rigging @ (controls, 1). `sbs_sim.Aircraft.mix`
    has the rows.
    """
    records = as_records(like)
    mix(rigging, as_lanes(controls, records), 0, as_lanes(swash, records))
