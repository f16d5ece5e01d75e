"""Tables of a scenario file about what lies between law and body: command, sensors, estimator and actuation.

The defaults of sensors are chapter IV's robot's; a scenario asks for them by an empty table, `[sensors.gyro]`.
"""

import math
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta

from biped.base.typed import Hold, Name, NonNegative, Positive, Real, Section, Six
from biped.scenario.gains import Gains


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


class Pushing(Section, frozen=True):
    """Settings of the law for ground that only pushes (`actuation.contacts = "pushing"`; docs/pushing.md).

    Attributes:
        friction: Coefficient of friction it counts on.
        approach: Time constant τ [s] within which a point that comes near enters the wanted motion.
        braking: Share of the deceleration of a critically damped landing within τ that the wanted motion takes from a
            point that comes down faster; 0: its speed stays until it strikes.
        reach: Height η [m] over which a point's force fades out.
        yielding: Acceleration σ [m/s²] off the ground over which a force fades out.
        regularisation: ε [1/(kg m²)], the price of torques.
        stops: Whether torques count on the knees' stops; without, a knee's own torque does what its stop would.
        smoothing: Time constant [s] with which torques go to what is asked for; 0: at once.
        slew: Largest rate [N m/s] at which a torque changes, as the voltage of a motor's supply bounds the rate of its
            current; 0: any.
        compensation: Share of the joints' damping and dry friction, as the model file says them, that motors make up
            for; of a biped in space.
        learning: Whether that share is only where it begins, and legs in the air show what their joints really lose; of
            a biped in space with joint torques.
    """

    friction: Positive = 1.0
    approach: Positive = 0.02
    braking: Annotated[float, Meta(ge=0, le=1)] = 0.0
    reach: Positive = 0.002
    yielding: Positive = 8.0
    regularisation: Positive = 1e-3
    stops: bool = True
    smoothing: Hold = 0.0
    slew: NonNegative = 0.0
    compensation: Annotated[float, Meta(ge=0, le=2)] = 1.0
    learning: bool = False


class Actuation(Section, frozen=True):
    """How Q_d becomes torques.

    Attributes:
        mode: `joint` torques by (3.15), or Q_d itself as `generalized` forces, which no robot can do.
        assist: Share of Q_d itself that acts, the rest being joint torques: the way of a search from one to the other;
            of a biped in space.
        contacts: Rows of A: candidates that pass the release test (`released`), or all that are `touching`; or ground
            that only pushes (`pushing`), with the torque limits inside the problem.
        pushing: What the last of these takes the ground for.
        release_force: Pull [N] beyond which a touching point is not a constraint.
        torque_limit: [N m] of every joint, or one limit for each: of seven links six, hip, knee, ankle, right then
            left; of a robot of another kind in the order of its actuators.
        limit: What happens beyond the limit: `clip`, or the `bounded` form of (3.13), a QP in the ticks where a limit
            is exceeded.
        solver: Who solves the bounded form: the exact `active_set`, or a package, for comparison.
        null_torque: u_0 (6,) [N m] of (4.7), the torques preferred where the solution is not unique.
        single_tangential: One tangential row per flat foot instead of two that say the same; on ground that only
            pushes, the toe's is the heel's, whatever is wrong with that.
        observer: Bandwidth [1/s] of the disturbance observer: it estimates the joint torques that the law's mechanics
            do not explain, and the law takes them off those it asks for; 0: none. Of seven links (docs/pushing.md).
        rank_tolerance: Relative size below which a row of C is dependent on others.
        lag: Time constant [s] of the actuators' first-order response; 0: torques follow at once.
        delay: [s] by which what the law commands acts late, rounded to ticks; what it commands first acts at once. Of a
            robot of any kind, as is the next.
        delay_jitter: [s] Most that is added to it, drawn anew for every tick; what arrives after a later command is
            dropped.
        motors: Keep torques within the torque-speed line of the robot's motors too.
    """

    mode: Literal["joint", "generalized"] = "joint"
    assist: Annotated[float, Meta(ge=0, le=1)] = 0.0
    contacts: Literal["released", "touching", "pushing"] = "released"
    pushing: Pushing = Pushing()
    release_force: NonNegative = 150.0
    # (A fixed-length tuple of constrained numbers in a union crashes msgspec 0.22.)
    torque_limit: Positive | Annotated[tuple[Positive, ...], Meta(min_length=1, max_length=1000)] = 200.0
    limit: Literal["clip", "bounded"] = "clip"
    solver: Literal["active_set", "daqp", "quadprog", "osqp"] = "active_set"
    null_torque: Six | None = None
    single_tangential: bool = False
    observer: Annotated[float, Meta(ge=0, le=1e4)] = 0.0
    rank_tolerance: Annotated[float, Meta(gt=0, lt=1)] = 1e-4
    lag: Hold = 0.0
    delay: Hold = 0.0
    delay_jitter: Hold = 0.0
    motors: bool = False


class ActuationChange(Section, frozen=True):
    """Settings of `[actuation]` that may change during a run, of bipeds in the plane.

    Attributes:
        contacts: As there.
        release_force: As there [N].
    """

    contacts: Literal["released", "touching"] | None = None
    release_force: NonNegative | None = None


class Change(Section, frozen=True):
    """Settings that hold from a time on; changes follow one another.

    Attributes:
        at: [s] when it begins.
        over: [s] during which gains go linearly to their new values; settings of the actuation change at once. Default:
            as `[transitions]` says where `to` is `start`, or `first` after a `start`; elsewhere 0.
        controller: Name or path of the gait from then on; default: what held before.
        to: Instead of a controller: `first`, the gait that the run began with, however it was searched for or drawn; or
            `stop`, `stand` or `start`, the gaits by which that one stops, stands and sets off, as its file says in
            `[transitions]`.
        after_landing: [s] from the next landing of a foot to its beginning; default: as `[transitions]` says for
            `to`, or it begins at once.
        gains: Gains that replace its; with `speed`, the gains of its family at that speed.
        actuation: Settings that change.
    """

    at: NonNegative
    over: NonNegative | None = None
    controller: Name | None = None
    to: Literal["first", "stop", "stand", "start"] | None = None
    after_landing: NonNegative | None = None
    gains: Gains = Gains()
    actuation: ActuationChange = ActuationChange()


WAYS = ("forward", "left", "yaw")
"""Components of a command, in their order."""
COMMANDED = tuple(f"command_{way}" for way in WAYS)
"""Signals of a run that a command is logged as."""


class CommandPiece(Section, frozen=True):
    """A command that holds from a time on.

    Attributes:
        at: [s] when it begins.
        over: [s] over which the command goes to it in a straight line; 0: at once.
        forward: [m/s] in the direction that the base faces.
        left: [m/s].
        yaw: [rad/s], to the left positive.
    """

    at: NonNegative
    over: Hold = 0.0
    forward: Real = 0.0
    left: Real = 0.0
    yaw: Real = 0.0


class Command(Section, frozen=True):
    """The velocity that a law is asked for.

    Attributes:
        forward: [m/s] in the direction that the base faces.
        left: [m/s].
        yaw: [rad/s], to the left positive.
        piece: What it becomes later.
    """

    forward: Real = 0.0
    left: Real = 0.0
    yaw: Real = 0.0
    piece: Annotated[tuple[CommandPiece, ...], Meta(max_length=1000)] = ()

    def at(self, time: float) -> tuple[float, float, float]:
        """Forward, left [m/s] and yaw [rad/s] at a time [s]."""
        if not self.piece:
            return self.forward, self.left, self.yaw
        forward, left, yaw = self.over(np.array([time]))[0].tolist()
        return forward, left, yaw

    def over(self, times: np.ndarray) -> np.ndarray:
        """(n, 3) the same at times (n,) [s]."""
        now, begun = np.tile([self.forward, self.left, self.yaw], (len(times), 1)), np.ones(len(times), dtype=bool)
        for piece in self.piece:
            begun &= times >= piece.at - 1e-9
            gone = np.maximum(0.0, times - piece.at)
            share = np.minimum(1.0, gone / piece.over) if piece.over > 0.0 else np.ones(len(times))
            then = now + share[:, None] * (np.array([piece.forward, piece.left, piece.yaw]) - now)
            now = np.where(begun[:, None], then, now)
        return now
