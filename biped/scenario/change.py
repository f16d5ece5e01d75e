"""Changes in mid-run, a table of a scenario file: settings that hold from a time on."""

from __future__ import annotations

from typing import Literal

from biped.scenario.gains import Gains
from biped.scenario.section import Name, NonNegative, Section


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
