"""The ground, a table of a scenario file: slope, tiles, steps, contacts."""

from typing import Annotated, Literal

from msgspec import Meta

from biped.scenario.section import Real, Section


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
