"""Gauss's nodes on the unit interval and what they integrate and interpolate: one step across a singular position."""

from functools import cache

import numpy as np
from numpy.polynomial import legendre

NODES = 9


def _nodes() -> tuple[np.ndarray, np.ndarray]:
    x, w = legendre.leggauss(NODES)
    return 0.5 * (x + 1.0), 0.5 * w


def _integrals(c: np.ndarray) -> np.ndarray:
    """(s, s) integrals of the Lagrange polynomials of the nodes c from 0 to each of them."""
    basis = np.eye(NODES)
    at = legendre.legvander(2.0 * c - 1.0, NODES - 1)
    up_to = np.column_stack([legendre.legval(2.0 * c - 1.0, legendre.legint(e, lbnd=-1)) for e in basis]) / 2.0
    return up_to @ np.linalg.inv(at)


def _without(c: np.ndarray) -> np.ndarray:
    """(s, s) row i: weights of the other nodes in the value that their polynomial has at node i."""
    X = np.zeros((NODES, NODES))
    for i in range(NODES):
        others = [k for k in range(NODES) if k != i]
        for k in others:
            X[i, k] = np.prod([(c[i] - c[j]) / (c[k] - c[j]) for j in others if j != k])
    return X


def _poorer(c: np.ndarray, kept: tuple[int, ...]) -> np.ndarray:
    """(s,) weights of the quadrature on a few of the nodes, symmetric: exact up to the degree of their number."""
    weights = np.zeros(NODES)
    # Moments about the middle are better conditioned than those about an end.
    moments = np.array([(0.5 ** (i + 1) - (-0.5) ** (i + 1)) / (i + 1) for i in range(len(kept))])
    weights[list(kept)] = np.linalg.solve(np.vander(c[list(kept)] - 0.5, increasing=True).T, moments)
    return weights


@cache
def table() -> np.ndarray:
    """(2s + 4, s) everything that a leap needs, in one array; `INTEGRAL` … `ERROR` are the rows of its parts.

    From `INTEGRAL`: weights of the states at the nodes; from `WITHOUT`: of the other nodes in what stands at one;
    `NODE`: the nodes as parts of the step; `WEIGHT`: of the end of the step, exact for polynomials of degree
    2s − 1; `ERROR`: of two estimates of its error, which see degrees from 6 and from 4 on. (One that saw no degree
    below 8 would see nothing: what stands at nine nodes has degree 7, with one of them told by the others.)
    """
    c, b = _nodes()
    return np.vstack((_integrals(c), _without(c), c, b, b - _poorer(c, (0, 2, 4, 6, 8)), b - _poorer(c, (1, 4, 7))))


INTEGRAL, WITHOUT, NODE, WEIGHT, ERROR = 0, NODES, 2 * NODES, 2 * NODES + 1, 2 * NODES + 2
