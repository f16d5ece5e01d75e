"""Planar bipeds of seven links: a torso and two legs of three links, with a compiled fast path of their own."""
