"""Flight in time: simulations, and complete flights under commands."""
