"""Bodies in natural coordinates: what `biped.dynamics.build` is made of."""
