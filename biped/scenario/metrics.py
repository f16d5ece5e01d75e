"""Every number that a run is measured by: its name, unit, meaning, and how it is shown.

One list for all: what `biped.measure` computes, what [expect] and [thesis] may name, what tables print.
"""

import math
from typing import Any, Literal, NamedTuple

from biped.base.errors import markdown_table


class Metric(NamedTuple):
    """One number.

    Attributes:
        name: In results, and in [expect] and [thesis].
        unit: As in a table; empty for a ratio.
        meaning: In words, without the unit.
        kind: Of an ensemble, a `count` of runs, or the `mean` over the runs that walked.
        show: As a `number` of three digits, or a fraction as a `share` in percent.
        better: Whether `more` or `less` of it is better of a walker, all else equal; `neither` says nothing by itself.
        table: The smallest table that it is in: `head` of every table, `run` (a result on a terminal), `engines` (two
            engines side by side), or `file` (results on disk, --json).
    """

    name: str
    unit: str
    meaning: str
    kind: Literal["count", "mean"] = "mean"
    show: Literal["number", "share"] = "number"
    table: Literal["head", "run", "engines", "file"] = "file"
    better: Literal["more", "less", "neither"] = "neither"

    @property
    def words(self) -> str:
        """The name for people."""
        return self.name.replace("_", " ")

    @property
    def explained(self) -> str:
        """Unit and meaning in one line."""
        return f"{self.unit}: {self.meaning}" if self.unit else self.meaning

    def text(self, value: Any) -> str:
        """A value for people; a dash if there is none."""
        if value is None or not math.isfinite(value):
            return "–"
        if self.kind == "count" and value == int(value):
            return str(int(value))
        if self.show == "share":
            return f"{100.0 * value:.3g} %"
        return f"{float(f'{value:.3g}'):.0f}" if 1e3 <= abs(value) < 1e6 else f"{value:.3g}"


_WALKED = (
    "runs that walked: stayed up, went further (a human than 0.2 m/s x duration) and faster (0.3 m/s in the window) "
    "than the robot's least, upright, by steps that alternate, on feet that bear the weight and neither slide nor sink"
)

_ALL = (
    Metric("falls", "", "runs that fell, whatever the verdict on their numbers, or whose numbers diverged", "count",
           better="less"),
    Metric("diverged", "", "runs whose numbers blew up, which count as falls", "count", better="less"),
    Metric("doubtful", "", "runs with a sentinel that failed: they may have fallen, but count as neither walking, "
           "standing nor sitting", "count", better="less"),
    Metric("walked", "", _WALKED, "count", table="engines", better="more"),
    Metric("straight", "", "runs that walked and went straight: veering and heading within 5 degrees of "
           "the x axis; in the plane all that walked", "count", better="more"),
    Metric("stood", "", "runs that stood still in a window of at least 1 s: no foot strike, torso within 0.1 m of its "
           "mean place, upright, on feet that bear the weight", "count"),
    Metric("sat", "", "runs that sat still in a window of at least 1 s: at least half the weight on the seat, the rest "
           "on the feet, torso within 0.1 m of its mean place, upright", "count"),
    Metric("time", "s", "simulated"),
    Metric("distance", "m", "travelled by the torso along the ground"),
    Metric("speed", "m/s", "mean over the window, along x", table="head", better="more"),
    Metric("speed_std", "m/s", "standard deviation of the torso's forward velocity over the window", table="engines",
           better="less"),
    Metric("froude", "", "speed / sqrt(g leg length)", table="run"),
    Metric("cost_of_transport", "", "net: integral of |sum of joint powers| / (weight x distance)", table="head",
           better="less"),
    Metric("cost_of_transport_absolute", "", "integral of the sum of |joint powers| / (weight x distance)",
           table="run", better="less"),
    Metric("cost_of_transport_positive", "", "integral of the positive joint powers / (weight x distance)",
           table="run", better="less"),
    Metric("cost_of_transport_heat", "", "integral of the motors' I²R / (weight x distance)", better="less"),
    Metric("cost_of_transport_electrical", "",
           "integral of the electrical power that each motor draws, none given back / (weight x distance)",
           better="less"),
    Metric("step_length", "m", "heel to heel at foot strike", table="run"),
    Metric("step_frequency", "1/s", "steps per second, from the first foot strike in the window to the last",
           table="run"),
    Metric("steps", "", "foot strikes in the window"),
    Metric("alternation", "", "share of foot strikes that are the other leg's than the one before", show="share",
           better="more"),
    Metric("strayed", "m", "furthest that the torso was from its mean place in the window"),
    Metric("stopping_distance", "m", "travelled after the first change, of runs that stood", better="less"),
    Metric("double_support", "", "share of the window with both feet on the ground", show="share", table="head"),
    Metric("flight", "", "share of the window in the air", show="share", table="engines", better="less"),
    Metric("duty", "", "share of the window that a foot is on the ground", show="share"),
    Metric("step_duration", "s", "from foot strike to foot strike"),
    Metric("step_width", "m", "from foot to foot across the way walked, at foot strike; in space"),
    Metric("cross_over", "", "share of foot strikes beyond the other foot; in space", show="share", better="less"),
    Metric("margin_of_stability", "m", "from the extrapolated centre of mass sideways to the edge of what it stands "
           "on, least of each step; in space", better="more"),
    Metric("heading", "degrees", "mean heading of the last stride against the x axis, to the left positive; in space"),
    Metric("commanded", "m/s", "mean size of the commanded velocity; with [command]"),
    Metric("command_error", "m/s", "deviation of the mean velocity of each second from the command; with [command]",
           better="less"),
    Metric("yaw_error", "rad/s", "deviation of the mean turning rate of each second from the command; with [command]",
           better="less"),
    Metric("drift", "m", "sideways distance from the x axis through the start, to the left positive; in space"),
    Metric("veering", "degrees", "of the way walked, from start to end, against the x axis, to the left positive, "
           "where it is longer than a leg; in space"),
    Metric("peak_torque", "N m", "largest joint torque", table="run", better="less"),
    Metric("mean_torque", "N m", "mean of |joint torque|", table="run", better="less"),
    Metric("rms_torque", "N m", "largest root mean square of a joint's torque", better="less"),
    Metric("motor_load", "", "largest root mean square of a joint's torque / what motor and gear bear continuously",
           better="less"),
    Metric("gear_load", "", "largest joint torque / what the gear bears intermittently", better="less"),
    Metric("beyond_gear", "", "share of ticks with a torque beyond what the gear bears intermittently",
           show="share", better="less"),
    Metric("beyond_line", "", "share of ticks with a torque beyond the motors' torque-speed line",
           show="share", better="less"),
    Metric("saturation", "", "share of ticks with a torque at its limit", show="share", better="less"),
    Metric("peak_power", "W", "largest joint power", better="less"),
    Metric("torque_rate", "N m/ms", "mean of the largest change of a joint torque from tick to tick", better="less"),
    Metric("torque_rate_99", "N m/ms", "99th percentile of the largest change of a joint torque from tick to tick",
           better="less"),
    Metric("torque_jump", "N m", "largest change of a joint torque from tick to tick", better="less"),
    Metric("switches", "1/s", "changes of the leg states that the law believes in", table="engines", better="less"),
    Metric("constraint_switches", "1/s", "changes of the set of rows in A, which the law believes in", table="run",
           better="less"),
    Metric("peak_force", "N", "largest normal force of a point", table="run", better="less"),
    Metric("peak_foot_force", "N", "largest normal force under a foot, all its points together", better="less"),
    Metric("support", "", "mean normal ground force / weight", table="run"),
    Metric("foot_support", "", "mean normal force under the feet / weight"),
    Metric("seat_load", "", "mean normal force of the seat / weight, where there is one"),
    Metric("centre_of_pressure", "", "mean place of the ground force under a foot, 0 heel … 1 toe"),
    Metric("slip", "", "sliding of loaded feet / distance travelled", table="run", better="less"),
    Metric("penetration", "m", "deepest point", table="run", better="less"),
    Metric("sinking", "", "deepest point in the window / leg length"),
    Metric("com_height", "", "least height of the centre of mass above the ground in the window / leg length"),
    Metric("pull", "", "mean force of the declared pushes along the way in the window / weight"),
    Metric("clearance", "m", "lowest point of a foot in the middle half of a swing", table="run", better="more"),
    Metric("torso_lean", "degrees", "mean lean of the torso from the vertical, forward positive", table="run"),
    Metric("stance_knee", "degrees", "mean flexion of the knee of the only leg on the ground, in the middle half of "
           "its time"),
    Metric("torso_sway", "degrees", "standard deviation of the torso's lean", better="less"),
    Metric("tilt", "degrees", "most that the base leans from the vertical in the window, whichever way"),
    Metric("torso_error", "degrees", "root mean square error of the torso angle that the estimator infers",
           better="less"),
    Metric("torso_error_worst", "degrees", "largest error of the torso angle that the estimator infers", better="less"),
    Metric("underactuated", "", "share of ticks in which the estimator rests on the gyro", show="share", better="less"),
    Metric("longest_gap", "s", "longest time for which the estimator rests on the gyro", better="less"),
    Metric("gyro_clipped", "", "share of ticks with the gyro beyond its range", show="share", better="less"),
    Metric("push_impulse", "N s", "impulse of the strongest push, forward positive"),
    Metric("push_speed", "m/s", "impulse of the strongest push / mass of the robot"),
    Metric("push_froude", "", "impulse of the strongest push / (mass x sqrt(g leg length))"),
    Metric("push_share", "", "the strongest push / the largest that any controller could survive by steps of a leg "
           "length, as fast as those before it", show="share"),
    Metric("recovery_time", "s", "from the end of the last push until all steps are as fast as before it, "
           "within 10 % or two standard deviations", better="less"),
    Metric("first_step", "m", "length of the first step after the last push"),
    Metric("second_step", "m", "length of the second step after the last push"),
    Metric("third_step", "m", "length of the third step after the last push"),
    Metric("fourth_step", "m", "length of the fourth step after the last push"),
    Metric("energy_residual", "", "energy that work and losses do not explain / work", show="share", table="run"),
    Metric("energy_from_nowhere", "", "most energy that neither the start nor actuators nor pushes put in / work",
           show="share"),
    Metric("momentum_residual", "", "vertical momentum that the ground, gravity and pushes do not explain / impulse",
           show="share"),
    Metric("unexplained_force", "", "largest mean force over 0.2 s that gravity, the ground and pushes do not explain "
           "/ weight", show="share"),
    Metric("unexplained_moment", "", "largest mean moment about the centre of mass over 0.2 s that they do not explain "
           "/ (weight x leg length)", show="share"),
    Metric("link_speed", "m/s", "largest speed of a link's centre of mass"),
    Metric("contact_loss", "W", "mean power lost in ground contacts", table="engines", better="less"),
)  # fmt: skip

METRICS: dict[str, Metric] = {metric.name: metric for metric in _ALL}
"""By name, in the order of every table."""

_TABLES = ("head", "run", "engines", "file")


def metrics_of_table(table: str) -> list[Metric]:
    """The metrics of a table, smaller tables' included; see `Metric.table`."""
    return [metric for metric in _ALL if _TABLES.index(metric.table) <= _TABLES.index(table)]


HEAD: tuple[str, ...] = tuple(metric.name for metric in metrics_of_table("head"))
"""Columns of every table: speed, net cost of transport and double support."""


def as_markdown() -> str:
    """The list as the table of docs/results.md."""
    rows = []
    for metric in _ALL:
        meaning = metric.meaning.replace("|", "\\|")
        unit, better = metric.unit or "–", "–" if metric.better == "neither" else metric.better
        rows.append((f"`{metric.name}`", unit, metric.kind, better, meaning))
    return markdown_table(("metric", "unit", "of an ensemble", "better", "meaning"), rows)
