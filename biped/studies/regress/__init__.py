"""The regression guard: every shipped scenario's numbers against recorded ones, bit for bit where that can hold."""
