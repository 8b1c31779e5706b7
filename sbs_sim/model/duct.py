"""Thrust of the duct around a rotor (theory.md section 5; Leishman, Principles of Helicopter Aerodynamics, ch. 6)."""

from sbs_sim.model.kernel import kernel


@kernel
def duct_thrust(expansion, rotor_thrust):
    """Thrust of the duct along the shaft [N]: (2 a_w - 1) T_rotor; none for an open rotor's a_w = 1/2."""
    return (2.0 * expansion - 1.0) * rotor_thrust
