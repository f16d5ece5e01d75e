"""The controller under test: sensing, leg states, springs, allocation and the tick that joins them."""
