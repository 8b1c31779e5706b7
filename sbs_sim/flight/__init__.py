"""Flight in time: simulations, whole flights, and what flies them."""
