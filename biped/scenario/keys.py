"""A scenario file, typed. Reading and checking it is `biped.scenario.reading`.

Every field of these records is a key of the TOML file; the defaults are the settings of the published results in
docs/, obtained with the human; a robot's description may say otherwise (`[scenario]` in models/*.toml). Units are SI;
angles in files are degrees where the key says so and radians otherwise.
"""

from typing import Annotated, Literal

from msgspec import Meta, field

from biped.base.typed import Degrees, Hold, Name, Nine, NonNegative, Positive, Real, Section
from biped.scenario.devices import Actuation, Change, Command, Estimator, Sensors
from biped.scenario.engines import MUJOCO
from biped.scenario.gains import Gains
from biped.scenario.goals import Bound, Standard, Tune
from biped.scenario.randomise import FailureKeys, Randomise, Threshold
from biped.scenario.robot import Described
from biped.scenario.world import Disturbance, Ground, Push, Truth

GIVES_WAY = 0.01
"""[rad] beyond its stop that a joint of a deviating start may be: stops of walking robots give way by half of that, and
one that is further beyond throws the limb back with energy that nobody put in."""


class Start(Section, frozen=True):
    """How a run begins.

    Attributes:
        posture: A keyframe of the model; human: `heel_toe`, `flat`, `single` (captions of Figs 3.4–3.6).
        q: Nine absolute coordinates (x, y, θ, θ1 … θ6) [m, rad] instead of a posture.
        v: Their velocities [m/s, rad/s].
        contacts: Points that must touch: `right_toe`, `right_heel`, `left_toe`, `left_heel`; default: those the model
            names for the posture (none for q).
        settle: Project the posture onto the ground: the least change of the angles.
        jitter: Standard deviation [rad] on the seven angles, after settling, by which no joint comes further beyond its
            stop than a stop gives way, 10 mrad; the biped is then set down.
        upright: On a slope, the body of a posture of level ground is as upright as there and the legs reach down to
            where the feet were; of robots of any kind.
        walking: [s] of a walk on level ground from this posture, without pushes and changes of the gait. The run
            begins in the state in which that walk next stands on one foot, up to a second later; 0: it begins in the
            posture. Of the thesis's law on a robot of any kind.
    """

    posture: Name = "flat"
    q: Nine | None = None
    v: Nine = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    contacts: Annotated[tuple[Name, ...], Meta(max_length=16)] | None = None
    settle: bool = True
    jitter: NonNegative = 0.0
    upright: bool = False
    walking: Hold = 0.0


class Sensing(Section, frozen=True):
    """When the controller takes a point to touch, and how long a change must last before leg states follow it.

    Attributes:
        contact_height: [m] below which a point touches the ground.
        knee_angle: [rad] from its stop within which a knee's row may be in A.
        heel_on: Time [s] that contact of a heel must last before leg states follow it.
        heel_off: The same of its end [s].
        toe_on: The same of a toe's contact [s].
        toe_off: The same of its end [s].
        extended: [rad] from its stop within which a knee counts as extended (state 4).
        ahead: [rad] by which the thigh must lead the other (state 4).
        late_stance: Degrees; a toe-only leg whose thigh still leans further forward has just landed: state 1.
        passing: [rad]; a toe-only leg whose thigh leads the other by more drags its toe: state 3; below 0, one that is
            still behind by less; default: never.
        predict: [s] by which the law takes what it senses to be late, at most 1000 ticks: it moves what it senses on by
            its own mechanics under the torques that it has commanded since; 0: not. Of seven links in a plane.
        follow: Time constant [s] with which what the law believes of places and angles, which goes on by the same
            mechanics, goes to what is sensed; 0: at once.
        follow_rates: The same of rates.
        friction: Coefficient of friction that these mechanics count on; default: that of `[actuation.pushing]`.
    """

    contact_height: Positive = 0.001
    knee_angle: NonNegative = 0.02
    heel_on: Hold = 0.006
    heel_off: Hold = 0.004
    toe_on: Hold = 0.003
    toe_off: Hold = 0.003
    extended: NonNegative = 0.05
    ahead: Real = 0.1
    late_stance: Annotated[float, Meta(gt=0, le=36000)] = 100.0
    passing: Real | None = None
    predict: Hold = 0.0
    follow: Hold = 0.0
    follow_rates: Hold = 0.0
    friction: Positive | None = None


COMPILED, PINOCCHIO, ENGINE = "compiled", "pinocchio", "engine"
"""Of `control.mechanics`."""


class ControlKeys(Section, frozen=True):
    """Who computes what the thesis's law needs at every tick: mass matrix, bias forces, Jacobians and their rates.

    All three do it for the model file, whatever `[truth]` changes, at the sensed coordinates.

    Attributes:
        mechanics: `compiled`: kernels that Pinocchio referees once for every model; `pinocchio`: Pinocchio at every
            tick; `engine`: MuJoCo, for comparison, of robots in space; default: `compiled`, or `engine` of a model with
            ball joints, things that move beside the robot, or tendons with inertia.
    """

    mechanics: Literal["compiled", "pinocchio", "engine"] | None = None


class Backstep(Section, frozen=True):
    """Stepping back, which the thesis does not have: a step that is being lost ends with the foot behind.

    While the extrapolated centre of mass x + ẋ √(y/g), in the plane the torso's and in space the walker's, lies behind
    every contact, a leg in the air is in state 4 with its thigh held to an angle of its own. Its knee may be held too,
    bent until the thigh is back: a straight leg's foot meets the ground beside the other. With a gait in units of its
    walker (`unit = "mgl"`) its numbers are in those units, too, and `margin`, `k_d2` and `b_d2` may not be left out.

    Attributes:
        margin: [m] behind the rearmost contact from which the walker counts as falling back.
        theta_l: Degrees, the thigh's angle; below 90 the foot comes down behind.
        k_d2: [N m/rad] of the hip's spring.
        b_d2: [N m s/rad] of its damper.
        bend: [rad/rad] by which the knee's rest is bent for each radian that the thigh has still to go back.
        k_d3: [N m/rad] of the knee's spring to that rest; 0: the knee has the springs of state 4.
        b_d3: [N m s/rad] of its damper.
    """

    margin: Real = 0.04
    theta_l: Degrees = 60.0
    k_d2: NonNegative = 300.0
    b_d2: NonNegative = 10.0
    bend: NonNegative = 0.0
    k_d3: NonNegative = 0.0
    b_d3: NonNegative = 0.0


class Simulation(Section, frozen=True):
    """How the physics is stepped.

    Attributes:
        timestep: [s] of the physics.
        control_rate: [Hz] of the controller; the physics takes a whole number of steps per tick.
        integrator: MuJoCo's.
        cone: MuJoCo's friction cone.
        impratio: Ratio of MuJoCo's frictional to normal constraint impedance.
        tolerance: Of MuJoCo's solver.
        iterations: Most iterations of MuJoCo's solver in a step.
        ls_iterations: Most iterations of its line search.
        solver: MuJoCo's.
        approximation: Drake's of its contacts: `sap`, one convex problem; or `lagged`, with Coulomb's friction where a
            point slides, from the normal force at a step's beginning ([engines](engines.md#feet-that-land-sliding)).
        physics: Where what is not said here comes from: `scenario`, the defaults of these keys; or the model's `file`:
            time step, integrator, solver, cone, contacts and friction are what its MJCF says (MuJoCo's defaults where
            it says nothing), and the law is asked at every step. Of robots of any kind.
    """

    timestep: Annotated[float, Meta(ge=1e-7, le=0.1)] = 0.001
    control_rate: Annotated[float, Meta(ge=1, le=1e6)] = 1000.0
    integrator: Literal["Euler", "implicitfast", "implicit", "RK4", "discrete"] = "Euler"
    cone: Literal["elliptic", "pyramidal"] = "elliptic"
    impratio: Annotated[float, Meta(ge=1e-6, le=1e9)] = 10.0
    tolerance: Annotated[float, Meta(ge=0, le=100)] = 1e-10
    iterations: Annotated[int, Meta(ge=1, le=10_000)] = 100
    ls_iterations: Annotated[int, Meta(ge=1, le=10_000)] = 50
    solver: Literal["Newton", "CG", "PGS"] = "Newton"
    approximation: Literal["sap", "lagged"] = "sap"
    physics: Literal["scenario", "file"] = "scenario"


class Fall(Section, frozen=True):
    """Bounds of a fall; the run ends there.

    Attributes:
        height: Fraction of the start's torso height below which the biped has fallen.
        tilt: Degrees of torso lean from the vertical.
    """

    height: Annotated[float, Meta(gt=0, lt=1)] = 0.7
    tilt: Annotated[float, Meta(gt=0, le=180)] = 60.0


class Window(Section, frozen=True):
    """The part of a run that means are taken over.

    Attributes:
        start: [s]; default: half of the duration.
        end: [s]; default: the end of the run.
    """

    start: NonNegative | None = None
    end: Positive | None = None


class Scenario(Section, frozen=True):
    """One scenario file.

    Attributes:
        description: One line for people.
        model: Name in models/ or path of an MJCF or URDF file.
        robot: What the model is, if it is no planar biped of seven links ([robots.md](robots.md)); default: what the
            description beside the model file says.
        controller: Name in controllers/ or path of a gait file.
        reading: Name in readings/ or path of a reading of the thesis ([readings.md](readings.md)): settings that lie
            below this file's own keys; default: none.
        law: `thesis`: the thesis's law, for planar bipeds of seven links and for bipeds with a free base. `stand`: for
            any robot. `path.py:Class`: a law of the user's own, looked for beside this file first; it runs only if it
            is trusted ([security.md](security.md)). `card.toml`: a policy's card ([your-policy.md](your-policy.md)).
            Default: `thesis` for planar bipeds of seven links, for others what the description beside the model says.
        law_sha256: What the law was when results were made; written with them, so that a changed law is noticed.
        engine: `mujoco`; `home`: the thesis's own rigid contacts; or `drake` ([engines.md](engines.md)).
        duration: [s] of a run.
        seed: Everything random follows from it: the same scenario gives the same bytes on the same machine.
        start: How a run begins.
        ground: The ground.
        actuation: How Q_d becomes torques.
        sensing: What the controller takes for contact.
        control: Who computes the mechanics that the thesis's law needs.
        backstep: The step back; default: none, as in the thesis.
        simulation: How the physics is stepped.
        gains: Gains that replace those of the controller file.
        change: What holds from a time on.
        command: The velocity that a law is asked for, of robots of any kind; default: nothing is asked for.
        push: Forces on bodies.
        disturbance: A random force on a body all along; default: none.
        fall: What counts as a fall.
        sensors: What stands between the biped and the controller's measurements.
        estimator: What infers the posture from encoders, gyro and switches; default: nothing, the controller is told.
        truth: How the biped that walks differs from the model file.
        randomise: The ensemble.
        sweep: Up to two dotted scenario keys, each with the values it takes; every combination is an ensemble.
        threshold: When a sweep's threshold holds.
        failures: What is kept of runs that fell.
        window: What means are taken over.
        expect: What metrics are expected to be.
        thesis: The thesis's values of metrics, shown beside the result.
        tune: What `biped tune` searches for; other commands take no notice of it.
        standard: What `biped standard` tests; likewise.
    """

    description: Name = ""
    model: Name = "human"
    robot: Described | None = None
    controller: Name = "normal"
    reading: Name | None = None
    law: Name | None = None
    law_sha256: Name | None = None
    engine: Name = MUJOCO
    duration: Positive = 10.0
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0
    start: Start = Start()
    ground: Ground = Ground()
    actuation: Actuation = Actuation()
    sensing: Sensing = Sensing()
    control: ControlKeys = ControlKeys()
    backstep: Backstep | None = None
    simulation: Simulation = Simulation()
    gains: Gains = Gains()
    change: Annotated[tuple[Change, ...], Meta(max_length=100)] = ()
    command: Command | None = None
    push: Annotated[tuple[Push, ...], Meta(max_length=100)] = ()
    disturbance: Disturbance | None = None
    fall: Fall = Fall()
    sensors: Sensors = Sensors()
    estimator: Estimator | None = None
    truth: Truth = Truth()
    randomise: Randomise = Randomise()
    sweep: dict[str, tuple[bool | float | str, ...]] = field(default_factory=dict)
    threshold: Threshold = Threshold()
    failures: FailureKeys = FailureKeys()
    window: Window = Window()
    expect: dict[str, Bound] = field(default_factory=dict)
    thesis: dict[str, float] = field(default_factory=dict)
    tune: Tune | None = None
    standard: Standard | None = None

    @property
    def interval(self) -> tuple[float, float]:
        """The window [s]."""
        start = self.window.start
        end = self.window.end
        end = self.duration if end is None else end
        return (0.5 * self.duration if start is None else start), end
