"""How what walks differs from the model that its controller knows: a table of a scenario file."""

from typing import Annotated

from msgspec import Meta

from biped.scenario.section import Factor, Name, NonNegative, Positive, Real, Section, Seven


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
