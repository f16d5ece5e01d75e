"""How Q_d becomes torques: a table of a scenario file."""

from typing import Annotated, Literal

from msgspec import Meta

from biped.scenario.gains import Gains
from biped.scenario.section import Hold, Name, NonNegative, Positive, Section, Six


class Pushing(Section, frozen=True):
    """Settings of the law for ground that only pushes (`actuation.contacts = "pushing"`; docs/pushing.md).

    Attributes:
        friction: Coefficient of friction it counts on.
        approach: Time constant τ [s] within which a point that comes near enters the wanted motion.
        reach: Height η [m] over which a point's force fades out.
        yielding: Acceleration σ [m/s²] off the ground over which a force fades out.
        regularisation: ε [1/(kg m²)], the price of torques.
        stops: Whether torques count on the knees' stops; without, a knee's own torque does what its stop would.
        smoothing: Time constant [s] with which torques go to what is asked for; 0: at once.
        compensation: Share of the joints' damping and dry friction, as the model file says them, that motors make up
            for; of a biped in space.
        learning: Whether that share is only where it begins, and legs in the air show what their joints really lose; of
            a biped in space with joint torques.
    """

    friction: Positive = 1.0
    approach: Positive = 0.02
    reach: Positive = 0.002
    yielding: Positive = 8.0
    regularisation: Positive = 1e-3
    stops: bool = True
    smoothing: Hold = 0.0
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
        over: [s] during which gains go linearly to their new values; settings of the actuation change at once.
        controller: Name or path of the gait from then on; default: what held before.
        gains: Gains that replace its; with `speed`, the gains of its family at that speed.
        actuation: Settings that change.
    """

    at: NonNegative
    over: NonNegative = 0.0
    controller: Name | None = None
    gains: Gains = Gains()
    actuation: ActuationChange = ActuationChange()
