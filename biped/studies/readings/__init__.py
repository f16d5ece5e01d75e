"""Readings of the thesis: where its text leaves a choice, what each choice does to the numbers that it prints."""
