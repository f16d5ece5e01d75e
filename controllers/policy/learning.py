"""A small network that learns by imitation, in NumPy, and its ONNX file."""

from itertools import pairwise

import numpy as np

BATCH = 512


class Network:
    """Two hidden layers with tanh and a linear way past them, fitted by Adam (D. Kingma, J. Ba, ICLR 2015).

    Args:
        inputs: (n, k) examples of what it is shown.
        hidden: Width of its layers.
        outputs: How many numbers it returns.
        rng: Draws its weights.
    """

    def __init__(self, inputs, hidden, outputs, rng):
        sizes = [inputs.shape[1], hidden, hidden, outputs]
        self.mean, self.std = inputs.mean(0), inputs.std(0) + 1e-3
        self.parts = []
        for a, b in pairwise(sizes):
            self.parts += [(rng.standard_normal((a, b)) / np.sqrt(a)).astype(np.float32), np.zeros(b, np.float32)]
        self.parts.append(np.zeros((inputs.shape[1], outputs), np.float32))  # past the layers: most of it is linear
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
        """Its numbers (n, outputs) for observations (n, inputs)."""
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
        """Fits examples; returns the root mean square error."""
        count = epochs * (len(x) // BATCH)
        for i in range(count):
            pick = rng.integers(0, len(x), BATCH)
            self.step(x[pick], y[pick], rate * (0.05 + 0.95 * 0.5 * (1.0 + np.cos(np.pi * i / count))))
        pick = rng.integers(0, len(x), 20_000)
        return float(np.sqrt(np.mean((self(x[pick]) - y[pick]) ** 2)))


def save(network, path, metadata=None):
    """Writes a network as ONNX, with words for whoever reads it; inputs are normalised inside."""
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
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, [1, W3.shape[1]])],
        [numpy_helper.from_array(value.astype(np.float32), key) for key, value in parts.items()],
    )  # fmt: skip
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    helper.set_model_props(model, metadata or {})
    checker.check_model(model)
    save_model(model, str(path))
