"""The thesis's law of seven links in a plane: sensing, leg states, springs, allocation and the tick that joins them."""
