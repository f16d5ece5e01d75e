"""A biped with a free base: the loop that is compiled for the law `spatial`."""
