"""A run's numbers as a record: what is computed with has names, types and units; results and journals hold its JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import msgspec

from biped.measure.metrics.walking import apart
from biped.measure.verdict import SOUND

NAN = math.nan


class Row(msgspec.Struct, frozen=True, kw_only=True):
    """One run: which it was, how it ended, and every metric (nan where it does not exist).

    Attributes:
        index: Number in the campaign.
        seed: Its own seed.
        values: What its point of the sweep and its draws changed, by key.
        fell: Whether it fell, or its numbers diverged.
        end: `completed`, `fell`, `diverged` (its numbers were not finite any more), `RAISED`, or `LOST`.
        cause: How it ended, in words; empty if completed.
        verdict: On its numbers: `sound`, `doubtful` or `diverged` (`biped.measure.verdict`).
        doubt: Which sentinels failed; empty of sound numbers.
        diverged: Whether the verdict is that.
        doubtful: Whether the verdict is that.
        walked: Whether it walked (`biped.measure.metrics`).
        stood: 1 if it stood still in the window.
        sat: 1 if it sat still in the window.
        time: [s] simulated.
        distance: [m] along the ground.
        speed: [m/s] mean over the window.
        speed_std: [m/s] standard deviation over the window.
        froude: Speed / sqrt(g leg length).
        cost_of_transport: Net.
        cost_of_transport_absolute: Of the sum of absolute joint powers.
        cost_of_transport_positive: Of the positive joint powers.
        cost_of_transport_heat: Of the motors' I²R.
        cost_of_transport_electrical: Of the electrical power that motors draw.
        step_length: [m] heel to heel.
        step_frequency: [1/s].
        steps: Foot strikes in the window.
        alternation: Share of foot strikes of the other leg than the one before.
        strayed: [m] furthest that the torso was from its mean place.
        stopping_distance: [m] travelled after the first change; nan of a run without one, or that did not stand.
        double_support: Share of the window with both feet on the ground.
        flight: Share with neither.
        duty: Share of it that a foot is on the ground.
        step_duration: [s] from foot strike to foot strike.
        step_width: [m] from foot to foot across the heading.
        cross_over: Share of foot strikes beyond the other foot.
        margin_of_stability: [m] sideways, of the extrapolated centre of mass.
        heading: [degrees] change over the run, to the left positive.
        drift: [m] sideways, to the left positive.
        peak_torque: [N m] largest joint torque.
        mean_torque: [N m] mean of their absolute values.
        rms_torque: [N m] largest root mean square of a joint's.
        motor_load: Largest of them / what motor and gear bear continuously.
        gear_load: Peak torque / what the gear bears intermittently.
        beyond_gear: Share of ticks beyond that.
        beyond_line: Share of ticks beyond the motors' torque-speed line.
        saturation: Share of ticks with a torque at its limit.
        peak_power: [W] largest joint power.
        torque_rate: [N m/ms] mean of the largest change from tick to tick.
        switches: [1/s] changes of leg state.
        constraint_switches: [1/s] changes of the rows in A.
        peak_force: [N] largest normal force of a point.
        support: Mean normal ground force / weight.
        seat_load: Mean normal force of the seat / weight; nan without a seat.
        centre_of_pressure: Mean place under a foot, 0 heel … 1 toe.
        slip: [m/m] sliding of loaded points per distance.
        penetration: [m] deepest point.
        clearance: [m] lowest toe or heel in the middle of a swing.
        torso_lean: [degrees] mean, forward positive.
        torso_sway: [degrees] standard deviation.
        torso_error: [degrees] root mean square error of the inferred torso angle.
        torso_error_worst: [degrees] largest.
        underactuated: Share of ticks in which it rests on the gyro.
        longest_gap: [s] longest stretch of them.
        gyro_clipped: Share of ticks with the gyro beyond its range.
        push_impulse: [N s] of the strongest push, forward positive; these are nan of a run that is not pushed.
        push_speed: [m/s] impulse / mass.
        push_froude: Impulse / (mass sqrt(g leg length)).
        recovery_time: [s] from the end of the last push until all steps are as before it.
        first_step: [m] length of the first step after the last push.
        second_step: [m].
        third_step: [m].
        fourth_step: [m].
        energy_residual: Energy that nothing explains / work.
        energy_from_nowhere: Most energy that nothing put in / work.
        momentum_residual: Vertical momentum that nothing explains / impulse.
        link_speed: [m/s] largest of a link's centre of mass.
        contact_loss: [W] mean power lost in contacts.
        leg_states: Commonest `cycle` of leg states and its `share`; None for a run that ended before the window.
        per_joint: Peak and mean torque [N m] and peak power [W] of hip, knee and ankle; likewise.
        signals: Mean, smallest and largest in the window of what a law of the user's own logged, by name.
        warnings: The engine's, name to count.
    """

    index: int
    seed: int
    values: dict[str, Any]
    fell: bool
    end: str
    cause: str
    verdict: str = SOUND
    doubt: str = ""
    diverged: bool = False
    doubtful: bool = False
    walked: bool
    stood: int
    sat: int = 0
    time: float
    distance: float = NAN
    speed: float = NAN
    speed_std: float = NAN
    froude: float = NAN
    cost_of_transport: float = NAN
    cost_of_transport_absolute: float = NAN
    cost_of_transport_positive: float = NAN
    cost_of_transport_heat: float = NAN
    cost_of_transport_electrical: float = NAN
    step_length: float = NAN
    step_frequency: float = NAN
    steps: float = NAN
    alternation: float = NAN
    strayed: float = NAN
    stopping_distance: float = NAN
    double_support: float = NAN
    flight: float = NAN
    duty: float = NAN
    step_duration: float = NAN
    step_width: float = NAN
    cross_over: float = NAN
    margin_of_stability: float = NAN
    heading: float = NAN
    drift: float = NAN
    peak_torque: float = NAN
    mean_torque: float = NAN
    rms_torque: float = NAN
    motor_load: float = NAN
    gear_load: float = NAN
    beyond_gear: float = NAN
    beyond_line: float = NAN
    saturation: float = NAN
    peak_power: float = NAN
    torque_rate: float = NAN
    switches: float = NAN
    constraint_switches: float = NAN
    peak_force: float = NAN
    support: float = NAN
    seat_load: float = NAN
    centre_of_pressure: float = NAN
    slip: float = NAN
    penetration: float = NAN
    clearance: float = NAN
    torso_lean: float = NAN
    torso_sway: float = NAN
    torso_error: float = NAN
    torso_error_worst: float = NAN
    underactuated: float = NAN
    longest_gap: float = NAN
    gyro_clipped: float = NAN
    push_impulse: float = NAN
    push_speed: float = NAN
    push_froude: float = NAN
    recovery_time: float = NAN
    first_step: float = NAN
    second_step: float = NAN
    third_step: float = NAN
    fourth_step: float = NAN
    energy_residual: float = NAN
    energy_from_nowhere: float = NAN
    momentum_residual: float = NAN
    link_speed: float = NAN
    contact_loss: float = NAN
    leg_states: dict[str, Any] | None = None
    per_joint: dict[str, dict[str, float]] | None = None
    signals: dict[str, dict[str, float]] | None = None
    warnings: dict[str, int] = {}

    @property
    def lost(self) -> bool:
        """Whether nobody knows what became of it."""
        return self.end == LOST

    def as_dict(self) -> dict[str, Any]:
        """As in result.json: keys in order, what a run has none of left out."""
        fields = {name: getattr(self, name) for name in self.__struct_fields__}
        return {name: value for name, value in fields.items() if value is not None}

    @classmethod
    def of(cls, record: Mapping[str, Any]) -> Row:
        """The row that `as_dict` gave a record of; rows of versions before are brought up to date."""
        record = apart(record)
        return cls(**{name: record[name] for name in cls.__struct_fields__ if name in record})


RAISED = "raised"
"""How a run ended whose law, the user's own, failed: it neither walked nor fell."""
LOST = "lost"
"""How a run ended that cost two workers: it neither walked nor fell, its numbers are nan."""
