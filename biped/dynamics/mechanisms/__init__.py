"""The mechanisms of chapter II, each with its starts and a trusted solution."""
