"""Normal noise, the same to the last bit on every machine.

numpy promises the bits of PCG64, but neither those of its normal distribution nor those of the mathematical library
that it asks for the tails.
"""

import numpy as np
from numpy.typing import NDArray

from sbs_sim.lanes import as_lanes, as_records, sqrt
from sbs_sim.model.frames import ONE
from sbs_sim.model.kernel import entry
from sbs_sim.model.real_functions import logarithm
from sbs_sim.model.trigonometry import TURN, cosine_sine

Array = NDArray[np.float64]

UNIT = 2.0**-53  # maps integers of 53 bits to numbers between 0 and 1


def normal(source: np.random.PCG64, pairs: int) -> Array:
    """Independent normal numbers of mean 0 and variance 1, shape (pairs, 2)."""
    out = np.empty((pairs, 2, 1))
    _box_muller(source.random_raw(2 * pairs).reshape(-1, 2) >> np.uint64(11), ONE, out)
    return out[..., 0]


@entry
def _box_muller(bits, like, out):
    """Pairs of normal numbers from pairs of integers of 53 bits.

    G. E. P. Box, M. E. Muller: A note on the generation of random normal deviates, Ann. Math. Stat. 29 (2), 1958.
    """
    found = as_lanes(out, as_records(like))
    for i in range(bits.shape[0]):
        found[i, 0] = -2.0 * logarithm((float(bits[i, 0]) + 0.5) * UNIT)
        radius = sqrt(found[i, 0])
        found[i, 1] = TURN * UNIT * float(bits[i, 1])
        cosine, sine = cosine_sine(found[i, 1])
        found[i, 0], found[i, 1] = radius * cosine, radius * sine
