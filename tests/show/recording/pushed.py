"""What tests of the recording of `conftest` share: where it begins, and its times."""

import numpy as np

ROOT = r"/up\ hill\/push"


def nanoseconds(trajectory, rows):
    return np.round(1e9 * trajectory.time[rows]).astype("i8")


def frames(trajectory):
    return np.arange(0, len(trajectory), 17)  # 60 Hz of 1 kHz
