"""Makes walker.onnx: a network learns the torques of the gait calm, first from it, then from its own mistakes.

    pip install 'biped[onnx]' onnx
    python controllers/policy/distill.py controllers/policy/walker.onnx

DAgger (S. Ross, G. Gordon, D. Bagnell, AISTATS 2011): walks are steered by the teacher at first and by the network
later, with noise on the torques; what the teacher would have done is noted at every tick, and the network is fitted to
all of it. NumPy only; the teacher is the compiled law.
"""

import sys
from pathlib import Path

import numpy as np
from learning import Network, save
from walker import Walker

import biped
from biped.control.planar.setup import controller_record
from biped.control.planar.tick import pushing_tick
from biped.control.planar.user import PlanarObservation
from biped.control.policy import places
from biped.ensemble.plan import Plan
from biped.robot.columns import WIDTH
from biped.scenario.reading import read_scenario

SEED, HIDDEN, SECONDS = 7, 96, 5.0
ROUNDS, EPOCHS = 16, 8
POSTURES = ("heel_toe", "flat", "single")
CALM = {"duration": SECONDS, "window.start": 1.0, "window.end": SECONDS, "actuation.contacts": "released"}
LOG = np.zeros((2, WIDTH))  # of the teacher's ticks, which nobody reads


class Teacher:
    """The compiled law of calm, tick by tick beside another law's run."""

    def __init__(self, posture):
        self.run = Plan(read_scenario("calm/own", [f"start.posture={posture}"])).run(0)
        self.record = controller_record(self.run, self.run.tree)
        self.q, self.v, self.k = np.zeros(9), np.zeros(9), 0

    def __call__(self, sensed):
        """Its torques (6,) [N m]."""
        self.q[:], self.v[:] = sensed.q, sensed.v
        pushing_tick(self.record, self.q, self.v, LOG, min(self.k, 1), sensed.time)
        self.k += 1
        return self.record[0]["tick"]["u"].copy()


class Apprentice:
    """Walks by a mixture of teacher and network, with noise, and notes what the teacher would have done."""

    def __init__(self, posture, network, share, noise, seed, notes):
        self.teacher, self.network, self.share, self.noise = Teacher(posture), network, share, noise
        self.rng, self.notes, self.jolt = np.random.default_rng(seed), notes, np.zeros(6)
        self.seen = places(PlanarObservation.names_of(self.teacher.run.robot), Walker.observations)

    def begin(self, setup):
        """The law of a run, itself: what it notes must outlast the run."""
        return self

    def torques(self, sensed):
        """Of whoever steers for these 50 ms."""
        seen = sensed.numbers[self.seen].astype(np.float32)
        right = self.teacher(sensed)
        self.notes.append((seen, (right / Walker.scale).astype(np.float32)))
        if self.teacher.k % 50 == 1:  # who steers, and how it is jolted, holds for 50 ms
            self.by_network = self.network is not None and self.rng.random() < self.share
            self.jolt = self.noise * self.rng.standard_normal(6) * (1.0, 1.0, 0.3, 1.0, 1.0, 0.3)
        own = Walker.scale * self.network(seen[None])[0] if self.by_network else right
        return np.clip(own + self.jolt, -150.0, 150.0)


def main(path):
    """Alternates walks and fits."""
    rng, notes, network = np.random.default_rng(SEED), [], None
    for turn in range(ROUNDS):
        share, noise = (min(1.0, 0.25 * turn), 2.0 * (turn % 2))
        before, lasted = len(notes), []
        for number, posture in enumerate(POSTURES):
            law = Apprentice(posture, network, share, noise, SEED + 100 * turn + number, notes)
            changes = {"start.posture": posture, "seed": 1000 * turn + number, "start.jitter": 0.004}
            result = biped.run("calm/own", law=law.begin, jobs=1, **CALM, **changes)
            lasted.append(round(float(result.summary["time"]), 2))
        x, y = (np.array(part) for part in zip(*notes, strict=True))
        if network is None:
            network = Network(x, HIDDEN, 6, rng)
        error = network.fit(x, y, rng, EPOCHS * (2 if turn in (0, ROUNDS - 1) else 1), 1e-3)
        print(f"turn {turn}: network steers {share:.0%}, walks lasted {lasted} s, {len(notes) - before} new of "
              f"{len(notes)} ticks, torque error {Walker.scale * error:.2f} N m", flush=True)  # fmt: skip
        save(network, path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
