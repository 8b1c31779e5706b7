"""Unsteadiness of the vortex ring: a fluctuation of the thrust about its measured mean (theory.md section 6.6).

M. Veismann, C. Dougherty, M. Gharib: Effects of rotor separation on the axial descent performance of dual-rotor
configurations, Flow, 2023, found the largest fluctuations of thrust at descents of 1.2 to 1.3 hover inflow velocities.
"""

from sbs_sim.lanes import as_lanes, as_records, maximum, minimum, rounded, sqrt
from sbs_sim.model import state as S
from sbs_sim.model.inflow import rotor_flow
from sbs_sim.model.interference import met_with_wash
from sbs_sim.model.kernel import kernel
from sbs_sim.model.records import LOAD, NOISE
from sbs_sim.model.trigonometry import TINY
from sbs_sim.model.wind_columns import WIND_SIZE

# Descent in hover inflow velocities: where the motion of a helicopter in the ring becomes unstable (W. Johnson,
# NASA/TP-2005-213477), where the fluctuations are largest, and where the windmill has a steady wake again; and the
# velocity along the disc over the same at which the ring is blown away (Johnson).
RING_BEGIN, RING_PEAK, WINDMILL_BEGIN, RING_EDGEWISE = 0.45, 1.25, 2.0, 0.95


@kernel
def set_ring_noise(model, wind, fraction, work):
    """Set the noise of every rotor from the columns behind those of the air of a tick, linear over the tick."""
    rotors = as_records(model.rotors)
    air, ring = as_lanes(wind, rotors), as_lanes(work.ring, rotors)
    count = ring.shape[1]
    for j in range(count):
        start, end = air[WIND_SIZE + j], air[WIND_SIZE + count + j]
        ring[NOISE, j] = start + fraction * (end - start)


@kernel
def add_ring(aircraft, memory):
    """Add to the wash of every rotor what lets its thrust fluctuate with its noise, eqs. (6.23) and (6.24)."""
    ring, wash = memory.ring, memory.wash
    for j in range(aircraft.rotors.shape[0]):
        rotor, uniform = aircraft.rotors[j], memory.state[aircraft.rotors[j].inflow + S.UNIFORM]
        mu = met_with_wash(memory, j, memory.flow[j].velocity * rotor.inverse_tip_speed)
        hover_squared = maximum(uniform * rotor_flow(rotor, uniform, mu).uniform, 0.0)  # lambda_h^2
        share = rounded(rotor.ring_unsteadiness * ring_share(mu, hover_squared))
        missing = rounded(rounded(2.0 * hover_squared) * rounded(share * ring[NOISE, j]))
        ring[LOAD, j] = missing
        wash[S.UNIFORM, j] = wash[S.UNIFORM, j] + missing * rotor.ring_gain


@kernel
def ring_share(mu, hover_squared):
    """Fluctuation over the largest one: 0 outside of the ring, 1 at `RING_PEAK` without velocity along the disc."""
    inverse = 1.0 / sqrt(hover_squared + TINY)
    descent, along = rounded(mu.z * inverse), rounded(inverse * inverse) * (mu.x * mu.x + mu.y * mu.y)
    kept = maximum(1.0 - along * (1.0 / RING_EDGEWISE**2), 0.0)
    rise = smooth_step((descent - RING_BEGIN) * (1.0 / (RING_PEAK - RING_BEGIN)))
    fall = smooth_step((WINDMILL_BEGIN - descent) * (1.0 / (WINDMILL_BEGIN - RING_PEAK)))
    return rounded(rise * fall) * rounded(kept * kept)


@kernel
def smooth_step(x):
    """Cubic from 0 to 1 with a slope of zero at both ends, constant beyond them."""
    t = minimum(maximum(x, 0.0), 1.0)
    return rounded(rounded(t * t) * (3.0 - 2.0 * t))
