"""Makes walker.onnx: a network learns the torques of the gait calm, first from it, then from its own mistakes.

    pip install 'biped[onnx]' onnx
    python controllers/policy/distill.py controllers/policy/walker.onnx

DAgger (S. Ross, G. Gordon, D. Bagnell, AISTATS 2011): walks are steered by the teacher at first and by the network
later, with noise on the torques; what the teacher would have done is noted at every tick, and the network is fitted to
all of it. NumPy only; the teacher is the compiled law.
"""

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
from walker import Walker

import biped
from biped.control.planar.setup import controller_record
from biped.control.planar.tick import pushing_tick
from biped.control.policy import everything, places
from biped.ensemble.plan import Plan
from biped.measure.columns import WIDTH
from biped.scenario.reading import read_scenario

SEED, HIDDEN, SECONDS = 7, 96, 5.0
ROUNDS, EPOCHS, BATCH = 16, 8, 512
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
        self.seen = places(self.teacher.run.robot, Walker.observations)

    def begin(self, setup):
        """The law of a run, itself: what it notes must outlast the run."""
        return self

    def torques(self, sensed):
        """Of whoever steers for these 50 ms."""
        seen = everything(sensed)[self.seen].astype(np.float32)
        right = self.teacher(sensed)
        self.notes.append((seen, (right / Walker.scale).astype(np.float32)))
        if self.teacher.k % 50 == 1:  # who steers, and how it is jolted, holds for 50 ms
            self.by_network = self.network is not None and self.rng.random() < self.share
            self.jolt = self.noise * self.rng.standard_normal(6) * (1.0, 1.0, 0.3, 1.0, 1.0, 0.3)
        own = Walker.scale * self.network(seen[None])[0] if self.by_network else right
        return np.clip(own + self.jolt, -150.0, 150.0)


class Network:
    """Two hidden layers with tanh, fitted by Adam (D. Kingma, J. Ba, ICLR 2015)."""

    def __init__(self, inputs, rng):
        sizes = [inputs.shape[1], HIDDEN, HIDDEN, 6]
        self.mean, self.std = inputs.mean(0), inputs.std(0) + 1e-3
        self.parts = []
        for a, b in pairwise(sizes):
            self.parts += [(rng.standard_normal((a, b)) / np.sqrt(a)).astype(np.float32), np.zeros(b, np.float32)]
        self.parts.append(np.zeros((inputs.shape[1], 6), np.float32))  # past the layers: most of it is linear
        self.first = [np.zeros_like(p) for p in self.parts]
        self.second = [np.zeros_like(p) for p in self.parts]
        self.steps = 0

    def layers(self, x):
        """What stands in every layer."""
        W1, b1, W2, b2, W3, b3, W0 = self.parts
        h0 = (x - self.mean) / self.std
        h1 = np.tanh(h0 @ W1 + b1)
        h2 = np.tanh(h1 @ W2 + b2)
        return h0, h1, h2, h2 @ W3 + b3 + h0 @ W0

    def __call__(self, x):
        """Its numbers (n, 6) for observations (n, inputs)."""
        return self.layers(x)[3]

    def step(self, x, y, rate):
        """One step of Adam."""
        h0, h1, h2, out = self.layers(x)
        W2, W3 = self.parts[2], self.parts[4]
        e = (out - y) / len(x)
        g2 = (e @ W3.T) * (1.0 - h2 * h2)
        g1 = (g2 @ W2.T) * (1.0 - h1 * h1)
        grads = [h0.T @ g1, g1.sum(0), h1.T @ g2, g2.sum(0), h2.T @ e, e.sum(0), h0.T @ e]
        self.steps += 1
        for part, g, first, second in zip(self.parts, grads, self.first, self.second, strict=True):
            first[:] += 0.1 * (g - first)
            second[:] += 0.001 * (g * g - second)
            part[:] -= rate * (first / (1 - 0.9**self.steps)) / (np.sqrt(second / (1 - 0.999**self.steps)) + 1e-8)

    def fit(self, x, y, rng, epochs, rate):
        """Fits all that was noted; returns the root mean square error [N m]."""
        count = epochs * (len(x) // BATCH)
        for i in range(count):
            pick = rng.integers(0, len(x), BATCH)
            self.step(x[pick], y[pick], rate * (0.05 + 0.95 * 0.5 * (1.0 + np.cos(np.pi * i / count))))
        pick = rng.integers(0, len(x), 20_000)
        return float(np.sqrt(np.mean((self(x[pick]) - y[pick]) ** 2)) * Walker.scale)


def save(network, path):
    """Writes the network as ONNX; inputs are normalised inside."""
    from onnx import TensorProto, checker, helper, numpy_helper, save_model

    W1, b1, W2, b2, W3, b3, W0 = network.parts
    W1, W0 = W1 / network.std[:, None], W0 / network.std[:, None]
    b1, b3 = b1 - network.mean @ W1, b3 - network.mean @ W0
    parts = {"W0": W0, "W1": W1, "b1": b1, "W2": W2, "b2": b2, "W3": W3, "b3": b3}
    nodes, name = [], "observation"
    for i in (1, 2, 3):
        nodes.append(helper.make_node("Gemm", [name, f"W{i}", f"b{i}"], [f"a{i}"]))
        if i < 3:
            nodes.append(helper.make_node("Tanh", [f"a{i}"], [name := f"h{i}"]))
    nodes.append(helper.make_node("MatMul", ["observation", "W0"], ["past"]))
    nodes.append(helper.make_node("Add", ["a3", "past"], ["action"]))
    graph = helper.make_graph(
        nodes, "walker",
        [helper.make_tensor_value_info("observation", TensorProto.FLOAT, [1, len(W1)])],
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, [1, 6])],
        [numpy_helper.from_array(value.astype(np.float32), key) for key, value in parts.items()],
    )  # fmt: skip
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    checker.check_model(model)
    save_model(model, str(path))


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
            network = Network(x, rng)
        error = network.fit(x, y, rng, EPOCHS * (2 if turn in (0, ROUNDS - 1) else 1), 1e-3)
        print(f"turn {turn}: network steers {share:.0%}, walks lasted {lasted} s, {len(notes) - before} new of "
              f"{len(notes)} ticks, torque error {error:.2f} N m", flush=True)  # fmt: skip
        save(network, path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
