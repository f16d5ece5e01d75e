"""How likely a fall is: a probability with its interval, by counting or by splitting."""
