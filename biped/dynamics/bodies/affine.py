"""Sums like c + Σ aⱼ qⱼ, as dicts from coordinate to factor, and the quadratic rows that are made of them."""

from collections.abc import Mapping, Sequence

Affine = dict[int, float]
"""Factor of every coordinate; `ONE` holds the constant."""

Row = dict[tuple[int, int], float]
"""A row of Φ: factor of every product of two coordinates, j ≤ k; with `ONE` for j a single one, for both 1."""

ONE = -1


def plus(one: Mapping[int, float], two: Mapping[int, float], factor: float = 1.0) -> Affine:
    """One + factor · two."""
    total = dict(one)
    for j, a in two.items():
        total[j] = total.get(j, 0.0) + factor * a
    return {j: a for j, a in total.items() if a != 0.0}


def linear(one: Mapping[int, float]) -> Row:
    """A row that is no more than a sum."""
    return {(ONE, j): a for j, a in one.items()}


def inner(one: Sequence[Mapping[int, float]], two: Sequence[Mapping[int, float]], constant: float = 0.0) -> Row:
    """Σ oneᵢ twoᵢ + constant, of two vectors of sums."""
    row: Row = {(ONE, ONE): constant}
    for x, y in zip(one, two, strict=True):
        for j, a in x.items():
            for k, b in y.items():
                place = (min(j, k), max(j, k))
                row[place] = row.get(place, 0.0) + a * b
    return {place: a for place, a in row.items() if a != 0.0}


def scaled(row: Row, factor: float) -> Row:
    """Factor · row."""
    return {place: factor * a for place, a in row.items()}
