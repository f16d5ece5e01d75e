"""The thesis's law out of the plane: the same moments on bodies, leg states and allocation, with a free base."""
