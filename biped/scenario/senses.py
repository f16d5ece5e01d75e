"""Sensors of a robot, and the estimator of a posture that is not measured: tables of a scenario file.

The defaults are chapter IV's robot's; a scenario asks for them by an empty table, `[sensors.gyro]`.
"""

import math
from typing import Annotated

from msgspec import Meta

from biped.scenario.section import Hold, NonNegative, Positive, Real, Section


class Encoders(Section, frozen=True):
    """Incremental encoders of hips, knees and ankles.

    Attributes:
        resolution: Degrees of hip, knee and ankle; 0: exact.
        reference_error: Degrees, standard deviation of each encoder's zero, drawn once a run.
    """

    resolution: tuple[NonNegative, NonNegative, NonNegative] = (4.2e-3, 7.3e-3, 4.2e-3)
    reference_error: NonNegative = 0.0


class Gyro(Section, frozen=True):
    """A gyroscope on the torso: its rate, clipped, then filtered.

    Attributes:
        noise: Density of white noise [degrees/s/√Hz].
        range: Degrees/s either way beyond which it clips.
        cutoff: [Hz] of its first-order low-pass filter.
        bias: Degrees/s.
    """

    noise: NonNegative = 0.05
    range: Positive = 150.0
    cutoff: Positive = 50.0
    bias: Real = 0.0

    def deviation(self, rate: float) -> float:
        """[rad/s] of its noise at so many samples a second: white noise of density d has the variance d² rate / 2."""
        return math.radians(self.noise) * math.sqrt(0.5 * rate)

    def follow(self, rate: float) -> float:
        """Part of the difference to its input that its filter goes in a sample."""
        return -math.expm1(-2.0 * math.pi * self.cutoff / rate)


class Switches(Section, frozen=True):
    """Foot switches at toes and heels: whether a point touches, not how hard.

    Attributes:
        force: [N] normal force from which a switch closes.
        release: [N] below which a closed one opens again.
        debounce: [s] that a change must last before it is believed.
    """

    force: Positive = 5.0
    release: NonNegative = 2.0
    debounce: Hold = 0.0


class Sensors(Section, frozen=True):
    """Errors between the biped and the controller's measurements; with all at zero there are none.

    Encoders, gyro and switches are those of a robot whose posture an `[estimator]` infers. A robot of any kind has no
    encoders and switches; its gyro measures how its base turns, and its noises are those of base and joints.

    Attributes:
        angle_noise: Standard deviation [rad] of white noise on the seven joint coordinates that are angles; of a robot
            of any kind, on hinges and the orientation of its base; with an `[estimator]`, on the six encoders.
        rate_noise: The same on their rates [rad/s].
        height_noise: The same on the torso's x and z [m]; of a robot of any kind, on the place of its base.
        delay: [s], rounded to control ticks, of which there may be 100,000.
        quantisation: Resolution [rad] of the angles; of a robot of any kind, of its joints.
        zero_error: Standard deviation [rad] of each joint's zero, drawn once a run; of a robot of any kind.
        encoders: Of the joints; default: none.
        gyro: Of the torso; default: none.
        switches: Of toes and heels; default: none.
    """

    angle_noise: NonNegative = 0.0
    rate_noise: NonNegative = 0.0
    height_noise: NonNegative = 0.0
    delay: Hold = 0.0
    quantisation: NonNegative = 0.0
    zero_error: NonNegative = 0.0
    encoders: Encoders | None = None
    gyro: Gyro | None = None
    switches: Switches | None = None


class Estimator(Section, frozen=True):
    """Infers the torso's angle from what touches, (4.8), or else from the gyro, (4.9).

    Attributes:
        width: [m] which the points that touch must span for (4.8).
        blend: [s] over which the estimate goes over where what it rests on changes.
    """

    width: Annotated[float, Meta(ge=1e-6, le=100)] = 0.05
    blend: Hold = 0.01
