"""Tables of a scenario file about what a robot meets: ground, pushes, and how it differs from what its law knows."""

from typing import Annotated, Literal

from msgspec import Meta

from biped.base.typed import Factor, Force, Name, NonNegative, Positive, Real, Section, Seven


class Tiles(Section, frozen=True):
    """Tiles of unequal height, one after another along the way; beyond the last the ground is level again.

    Attributes:
        height: [m] Heights lie evenly between minus and plus this, drawn from the run's seed; 0: there are no tiles.
        length: [m] of a tile, more than its ramp.
        ramp: [m] over which the ground passes to the height of the next tile, in a straight line.
        start: [m] where the first begins, beyond the feet; a posture stands at 0.
        number: How many.
    """

    height: Annotated[float, Meta(ge=0, le=10)] = 0.0
    length: Annotated[float, Meta(ge=0.01, le=1000)] = 0.5
    ramp: Annotated[float, Meta(ge=0.001, le=1000)] = 0.05
    start: Real = 1.0
    number: Annotated[int, Meta(ge=1, le=400)] = 100


class Steps(Section, frozen=True):
    """Equal steps, one after another.

    Attributes:
        rise: [m] of each, negative for steps down; 0: there are no steps.
        run: [m] from one to the next, more than the ramp.
        ramp: [m] over which the ground passes to the next height, in a straight line.
        start: [m] where the first begins, beyond the feet; a posture stands at 0.
        number: How many.
        back: Whether as many lead back from where they end.
    """

    rise: Annotated[float, Meta(ge=-10, le=10)] = 0.0
    run: Annotated[float, Meta(ge=0.01, le=1000)] = 0.5
    ramp: Annotated[float, Meta(ge=0.001, le=1000)] = 0.05
    start: Real = 1.0
    number: Annotated[int, Meta(ge=1, le=50)] = 1
    back: bool = False


class Seat(Section, frozen=True):
    """A box to sit on. It meets the pelvis alone, a sphere about the hips: legs pass through it.

    Attributes:
        height: [m] of its top above the ground; 0: there is none.
        front: [m] where its front edge is along the ground; a posture stands at 0.
        depth: [m] from there to the edge behind.
        pelvis: [m] radius of the sphere.
    """

    height: Annotated[float, Meta(ge=0, le=10)] = 0.0
    front: Real = -0.15
    depth: Annotated[float, Meta(ge=0.01, le=100)] = 0.5
    pelvis: Annotated[float, Meta(ge=0.001, le=1)] = 0.08


class Ground(Section, frozen=True):
    """The ground.

    Attributes:
        slope: Degrees, uphill positive.
        tiles: Tiles of unequal height on it.
        steps: Steps on it.
        seat: Something on it to sit on; MuJoCo's, of bipeds in the plane.
        side_slope: Degrees, rising to the left; of robots that move in space.
        angles: What Q_d's absolute angles are measured from: the direction of gravity or the slope's normal.
        friction: Coefficient of Coulomb friction; with `simulation.physics = "file"` by default the file's, as are the
            next two.
        contact_time: Time constant [s] of MuJoCo's contacts and knee stops (solref), at least two time steps.
        damping_ratio: Their damping ratio.
    """

    slope: Annotated[float, Meta(gt=-45, lt=45)] = 0.0
    tiles: Tiles = Tiles()
    steps: Steps = Steps()
    seat: Seat = Seat()
    side_slope: Annotated[float, Meta(gt=-45, lt=45)] = 0.0
    angles: Literal["gravity", "slope"] = "gravity"
    friction: Annotated[float, Meta(ge=0, le=1e6)] | None = 3.0
    contact_time: Annotated[float, Meta(gt=0, le=1000)] | None = 0.004
    damping_ratio: Annotated[float, Meta(ge=1e-6, le=1e6)] | None = 1.0


class BodyTruth(Section, frozen=True):
    """A body of a robot of any kind.

    Attributes:
        name: Which.
        mass: Factor of its mass; moments of inertia follow.
        inertia: Factor of its moments of inertia on top.
        shift: [m] of its centre of mass, in the body's frame.
    """

    name: Name
    mass: Factor = 1.0
    inertia: Factor = 1.0
    shift: tuple[Real, Real, Real] = (0.0, 0.0, 0.0)


class UnmodelledKeys(Section, frozen=True):
    """Realities that nobody modelled: random smooth functions, drawn for every run and fixed in it.

    Draws of Gaussian processes: joint torques as a function of the joints' angles and rates, friction and softness of
    the ground as functions of the place on it. Torques stand for what a model leaves out between joints and their
    motors: cables, friction that depends on the posture, flexible parts, wrong maps of torque. Nothing here remembers,
    depends on time, or is the same in every robot.

    Attributes:
        torque: Root mean square over realities, as a share of each joint's torque limit. Of seven links the sum with
            the motor's torque stays within the limit and is what is recorded; of other robots it acts beside.
        angle: [rad] that a joint moves until the torque is another one; rates count as what they cover in 0.1 s.
        friction: Root mean square of the logarithm of a factor of the ground's friction: 0.3 is some 30 % more or less.
            MuJoCo's.
        softness: The same of a factor of the contacts' time constant, with whose inverse square stiffness goes; never
            less than two time steps. MuJoCo's.
        patch: [m] along the ground until friction and softness are others.
    """

    torque: Annotated[float, Meta(ge=0, le=10)] = 0.0
    angle: Positive = 0.3
    friction: Annotated[float, Meta(ge=0, le=3)] = 0.0
    softness: Annotated[float, Meta(ge=0, le=3)] = 0.0
    patch: Annotated[float, Meta(ge=0.001, le=1000)] = 0.5

    @property
    def patchy(self) -> bool:
        """Whether the ground differs from place to place."""
        return self.friction > 0.0 or self.softness > 0.0


class Truth(Section, frozen=True):
    """How the biped that walks differs from the model file that the controller knows: factors of each link.

    Links are torso, right thigh, shank, foot, left thigh, shank, foot. A length scales everything placed along the
    link; inertias follow masses and lengths (m l²) and are scaled by their own factor on top. Of a robot of any kind
    each body that differs has a table `[[truth.part]]`; `joint_damping` is that of all hinges but the base's, and so
    are `joint_friction`, `joint_losses` and `armature`. `strength` and what follows it are of these robots alone,
    `mass`, `inertia`, `length` and `hip_mass` of seven links.

    Attributes:
        mass: Factors of the masses.
        inertia: Factors of the moments of inertia beyond what mass and length imply.
        length: Factors of the lengths.
        joint_damping: [N m s/rad] added to hips, knees and ankles.
        hip_mass: [kg] that the torso carries on the hip's axis besides: of an arm that guides the robot, for example.
        strength: Factor of what the motors do: of torques and of those of servos, and of their limits.
        servo_stiffness: Factor of the servos' stiffness.
        servo_damping: Factor of their damping.
        joint_friction: [N m] of dry friction added to the joints.
        joint_losses: Factor of what joints lose by damping and by dry friction, with what is added.
        armature: [kg m²] of rotors added to the joints.
        unmodelled: Joint torques, friction and softness that nobody modelled.
        part: Bodies that differ, of a robot of any kind.
    """

    mass: Seven = (1.0,) * 7
    inertia: Seven = (1.0,) * 7
    length: Seven = (1.0,) * 7
    joint_damping: NonNegative = 0.0
    hip_mass: NonNegative = 0.0
    strength: Factor = 1.0
    servo_stiffness: Factor = 1.0
    servo_damping: Factor = 1.0
    joint_friction: NonNegative = 0.0
    joint_losses: Factor = 1.0
    armature: NonNegative = 0.0
    unmodelled: UnmodelledKeys = UnmodelledKeys()
    part: Annotated[tuple[BodyTruth, ...], Meta(max_length=1000)] = ()


PLANE, SPACE = 2, 3
"""Components of its force, of robots that move in the plane and in space."""


class Push(Section, frozen=True):
    """A force on a body.

    Attributes:
        at: [s] when it begins.
        duration: [s] for which it acts.
        force: [N] forward (horizontally) and up, of a robot that moves in space forward, to the left and up; of shapes
            that change, the largest.
        of: What the force is a multiple of: 1 N (`si`), or the robot's `weight` m g.
        body: A body of the model; the force acts at its centre of mass.
        shape: How the force goes with time: `constant`; a `ramp` from nothing to `force` at the end; or a `sine`.
        frequency: [Hz] of the sine.
        times: How often it comes.
        every: [s] from the begin of one to that of the next, where it comes more than once.
    """

    at: NonNegative
    duration: Positive
    force: Force
    of: Literal["si", "weight"] = "si"
    body: Name = "torso"
    shape: Literal["constant", "ramp", "sine"] = "constant"
    frequency: Annotated[float, Meta(gt=0, le=100)] = 1.0
    times: Annotated[int, Meta(ge=1, le=10_000)] = 1
    every: Positive = 1.0


class Disturbance(Section, frozen=True):
    """A random force on a body from a time to the end of the run: an Ornstein-Uhlenbeck process.

    Its components are independent, normal with mean zero, and correlated as exp(-t / correlation) over a time t.

    Attributes:
        force: [N] root mean square forward (horizontally) and up; of a robot that moves in space forward, to the left
            and up.
        correlation: [s] over which the force forgets what it was; it is constant for a tenth of that.
        body: A body of the model; the force acts at its centre of mass.
        at: [s] when it begins.
    """

    force: Force
    correlation: Annotated[float, Meta(gt=0, le=1000)] = 0.2
    body: Name = "torso"
    at: NonNegative = 0.0
