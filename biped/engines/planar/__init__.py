"""Seven links in a plane: the physics and loops that are compiled for them."""
