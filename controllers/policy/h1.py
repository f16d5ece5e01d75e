"""Makes h1.onnx: a network learns to walk with Unitree's H1 from a stepping law, first from it, then from its mistakes.

    pip install 'biped[onnx]' onnx
    python controllers/policy/h1.py controllers/policy/h1.onnx
    biped policy controllers/policy/h1.onnx --model h1 --rate 50 --clock 2     # writes the card h1.toml, and checks it

DAgger (S. Ross, G. Gordon, D. Bagnell, AISTATS 2011), with a plain loop of MuJoCo, in three minutes. The law steps by a
clock, as SIMBICON does (K. Yin, K. Loken, M. van de Panne, SIGGRAPH 2007): the foot in the air comes down where speed
and place of the base ask for it, the hip of the standing leg holds the trunk. Its numbers were found by CMA-ES.
"""

import sys
from pathlib import Path

import mujoco
import numpy as np
from learning import Network, save

MODEL = Path(__file__).parents[2] / "models" / "h1.xml"
JOINTS = [
    f"{side}_{name}" for side in ("left", "right") for name in ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle")
]
STIFFNESS, DAMPING = np.array([150, 200, 200, 250, 40.0] * 2), np.array([5, 6, 6, 6, 2.0] * 2)
HELD = 250.0, 6.0  # servos of joints that the policy does not command
DEFAULT, SCALE = np.array([0, 0, -0.31, 0.8, -0.49] * 2), 0.5
RATE, FREQUENCY, AHEAD = (
    50,
    2.0,
    0.1,
)  # Hz of calls, Hz of strides, rad by which the law's phase is ahead of the clock's
SIDE = np.array([1.0, -1.0])  # left, right
SEED, HIDDEN, ROUNDS, WALKS, SECONDS, EPOCHS = 3, 40, 16, 24, 6.0, 10
RANGES = np.array([[-0.4, 0.8], [-0.25, 0.25], [-0.6, 0.6]])  # m/s, m/s, rad/s


def feet(q):
    """(2, 3) [m] of left and right foot from the base, in its frame."""
    out = []
    for side, (_, roll, hip, knee, _) in zip(SIDE, q.reshape(2, 5), strict=True):
        x, z = -0.4 * (np.sin(hip) + np.sin(hip + knee)), -0.4 * (np.cos(hip) + np.cos(hip + knee))
        y = side * (0.0875 + 0.1154 * np.cos(roll)) - z * np.sin(roll)
        out.append((0.0395 + x, y, z * np.cos(roll) + side * 0.1154 * np.sin(roll) - 0.2442))
    return np.array(out)


def steps(phase, velocity, turning, gravity, command, q):
    """(10,) [rad] targets of the stepping law.

    Args:
        phase: [rad] the left foot stands in the first half.
        velocity: (3,) [m/s] of the base, in its frame.
        turning: (3,) [rad/s] likewise.
        gravity: (3,) its direction, likewise.
        command: (3,) forward, left [m/s], yaw [rad/s].
        q: (10,) [rad] joints of the legs.
    """
    pitch, roll = np.arcsin(np.clip([gravity[0], -gravity[1]], -1.0, 1.0))
    half, s = divmod(phase / np.pi, 1.0)
    stand, swing = (0, 1) if half == 0.0 else (1, 0)
    x, y, z = feet(q)[stand]
    forward = 0.42 * (velocity[0] - command[0]) - 0.29 * (x + z * pitch)
    left = 0.28 * (velocity[1] - command[1]) - 0.24 * (y - z * roll - 0.15 * SIDE[stand])
    out, a, b = np.empty(10), 5 * swing, 5 * stand
    knee = 0.71 + 0.79 * np.sin(np.pi * s)
    hip = -0.22 - 0.08 * command[0] - forward - 0.5 * (knee - 0.71) - pitch
    yaw = 0.16 * command[2] * (2.0 * s - 1.0)
    out[a : a + 5] = yaw, -0.046 * SIDE[swing] + left - roll, hip, knee, -hip - knee - pitch
    ankle = -q[b + 2] - 0.71 - pitch + 0.12 + 0.37 * (velocity[0] - command[0])
    out[b : b + 5] = (-yaw, q[b + 1] + 1.48 * roll + 0.125 * turning[0],
                      q[b + 2] + 2.9 * (pitch - 0.03) + 0.207 * turning[1], 0.71, ankle)  # fmt: skip
    return out


class Walk:
    """The robot in a plain loop: servos at its joints, a network or the law asked 50 times a second."""

    def __init__(self):
        self.model = m = mujoco.MjModel.from_xml_path(str(MODEL))
        own = {m.joint(name).id: i for i, name in enumerate(JOINTS)}
        self.order = np.array([m.actuator(name).id for name in JOINTS])
        self.places = np.array([m.joint(name).qposadr[0] for name in JOINTS])
        self.columns = np.array([m.joint(name).dofadr[0] for name in JOINTS])
        for i in range(m.nu):
            joint = own.get(int(m.actuator_trnid[i, 0]))
            k, b = HELD if joint is None else (STIFFNESS[joint], DAMPING[joint])
            m.actuator_gainprm[i, 0], m.actuator_biastype[i] = k, mujoco.mjtBias.mjBIAS_AFFINE
            m.actuator_biasprm[i, :3] = 0.0, -k, -b
            m.actuator_forcelimited[i], m.actuator_forcerange[i] = 1, m.actuator_ctrlrange[i]
            m.actuator_ctrllimited[i] = 0
        self.data, self.calls = mujoco.MjData(m), round(1.0 / (RATE * m.opt.timestep))

    def __call__(self, network, share, rng, notes):
        """Walks, steered by the network for a share of the time, with jolts; notes what the law would have done.

        Returns:
            [s] until it falls.
        """
        m, d = self.model, self.data
        mujoco.mj_resetDataKeyframe(m, d, m.key("stand").id)
        d.ctrl[:] = d.qpos[7:]
        d.qpos[self.places] += rng.normal(0.0, 0.02, 10)
        phase, action, command = 0.0, np.zeros(10), np.zeros(3)
        for k in range(round(SECONDS * RATE)):
            if k % 100 == 0:  # a command holds for 2 s; some of them are zero in some ways
                command = rng.uniform(*RANGES.T) * (rng.random(3) < 0.6)
                by_network = network is not None and rng.random() < share
            if k % 75 == 50:
                d.qvel[:2] += rng.normal(0.0, 0.15, 2)
            mujoco.mj_forward(m, d)
            turn = d.body("pelvis").xmat.reshape(3, 3)
            velocity, turning, gravity = turn.T @ d.qvel[:3], d.qvel[3:6].copy(), -turn[2]
            q, v = d.qpos[self.places], d.qvel[self.columns]
            shown = np.concatenate([velocity, 0.25 * turning, gravity, q - DEFAULT, 0.05 * v, action, command,
                                    [np.sin(phase), np.cos(phase)]]).astype(np.float32)  # fmt: skip
            right = (steps((phase + AHEAD) % (2.0 * np.pi), velocity, turning, gravity, command, q) - DEFAULT) / SCALE
            notes.append((shown, right.astype(np.float32)))
            action = network(shown[None])[0] if by_network else right + rng.normal(0.0, 0.05, 10)
            d.ctrl[self.order] = DEFAULT + SCALE * action
            mujoco.mj_step(m, d, self.calls)
            phase += 2.0 * np.pi * FREQUENCY / RATE
            if d.qpos[2] < 0.7 or turn[2, 2] < 0.7:
                return k / RATE
        return SECONDS


METADATA = {
    "joint_names": JOINTS, "joint_stiffness": STIFFNESS, "joint_damping": DAMPING, "default_joint_pos": DEFAULT,
    "command_names": ["twist"], "action_scale": [SCALE] * 10,
    "observation_names": ["base_lin_vel", "base_ang_vel", "projected_gravity", "joint_pos", "joint_vel", "actions",
                          "command", "phase"],
    "observation_terms_scale": [1.0, 0.25, 1.0, 1.0, 0.05, 1.0, 1.0, 1.0],
}  # fmt: skip
"""Words that mjlab writes into its files; numbers have three decimals there."""


def main(path):
    """Alternates walks and fits."""
    rng, notes, network, walk = np.random.default_rng(SEED), [], None, Walk()
    for turn in range(ROUNDS):
        share = min(1.0, 0.25 * turn)
        lasted = [walk(network, share, rng, notes) for _ in range(WALKS)]
        x, y = (np.array(part) for part in zip(*notes, strict=True))
        if network is None:
            network = Network(x, HIDDEN, 10, rng)
        error = network.fit(x, y, rng, EPOCHS * (3 if turn == ROUNDS - 1 else 1), 2e-3)
        print(f"turn {turn}: network steers {share:.0%}, {sum(t == SECONDS for t in lasted)} of {WALKS} walks lasted "
              f"{SECONDS:g} s, {len(notes)} calls, error {SCALE * error:.4f} rad", flush=True)  # fmt: skip
    words = {key: ",".join(one if isinstance(one, str) else f"{one:.3f}" for one in value)
             for key, value in METADATA.items()}  # fmt: skip
    save(network, path, words)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
