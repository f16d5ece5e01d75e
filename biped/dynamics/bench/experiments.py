"""`biped bench robot`: the bench experiments of chapter IV, in chapter II's solver and in MuJoCo.

A leg hangs from a torso that is held still. Fig 4.7: hip and knee swing freely, with the robot's gears and with high
ones. Fig 4.8: spring-dampers at hip, knee and ankle follow equilibria that move.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from biped.dynamics.bench.followed import Followed, follow
from biped.dynamics.bench.leg import MODEL, READINGS, Reading
from biped.dynamics.bench.swings import Swing, joints, swing


@dataclass(frozen=True, eq=False)
class Experiments:
    """Both figures of the bench with the hanging leg.

    Attributes:
        model: The model file.
        swings: Fig 4.7.
        followed: Fig 4.8.
    """

    model: str
    swings: tuple[Swing, ...]
    followed: Followed

    def as_dict(self) -> dict[str, Any]:
        """Plain data for `--json`."""
        named = lambda found: dict(zip(("hip", "knee", "ankle"), (r._asdict() for r in found), strict=True))  # noqa: E731
        return {
            "model": self.model,
            "swings": [
                {
                    "joint": swing.joint, "reading": swing.reading.name, "period": swing.period,
                    "damping_ratio": swing.damping_ratio, "mujoco_apart": swing.apart,
                }
                for swing in self.swings
            ],
            "followed": {
                "window": named(self.followed.window), "steady": named(self.followed.steady),
                "linear": named(self.followed.linear), "mujoco_apart": self.followed.apart,
            },
        }  # fmt: skip


def measure(readings: Sequence[Reading] = READINGS) -> Experiments:
    """Both figures, of the shipped robot."""
    swings = tuple(swing(MODEL, joint, reading) for joint in joints() for reading in readings)
    return Experiments(MODEL.stem, swings, follow(MODEL))
