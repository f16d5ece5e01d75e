"""Likely ways to fall, found on purpose and made as plain as they can be."""
