"""Bad gait and model files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tests.bad.kind import Bad

HUMAN = (Path(__file__).parents[2] / "models" / "human.xml").read_text(encoding="utf-8")


def model(edit: Callable[[str], str]) -> dict[str, str]:
    """A model file m.xml that differs from the human one."""
    text = edit(HUMAN)
    assert text != HUMAN
    return {"m.xml": text}


def swap(old: str, new: str, count: int = -1) -> dict[str, str]:
    return model(lambda text: text.replace(old, new, count))


def drop(start: str, end: str) -> dict[str, str]:
    """The human model without the text from `start` to `end` (both included)."""

    def edit(text: str) -> str:
        before, _, rest = text.partition(start)
        return before + rest.partition(end)[2]

    return model(edit)


GAITS = (
    Bad("gait by name beside the scenario", ("s.toml: controller: no controller 'g'", "'g.toml'"), 'controller = "g"',
        files={"g.toml": 'extends = "normal"'}),
    Bad("unknown key of a gait", ("g.toml: k_d22: unknown key", "'k_d2'"), 'controller = "g.toml"',
        files={"g.toml": 'extends = "normal"\nk_d22 = 1.0'}),
    Bad("gait that lacks a gain", ("g.toml: k_d2: missing", "theta_a"), 'controller = "g.toml"',
        files={"g.toml": "k_d1 = 1.0"}),
    Bad("gain of too few states", ("g.toml: k_d2: expected", "4", "got 2"), 'controller = "g.toml"',
        files={"g.toml": 'extends = "normal"\nk_d2 = [1.0, 2.0]'}),
    Bad("negative gain", ("s.toml: gains.k_d1: expected", ">= 0"), "gains.k_d1 = -400.0"),
    Bad("gait that is a model", ("s.toml: controller: no controller 'm.xml'",), 'controller = "m.xml"',
        files={"m.xml": HUMAN}),
)  # fmt: skip

MODELS = tuple(
    Bad(name, ("m.xml: ", *says), 'model = "m.xml"', files=files)
    for name, says, files in (
        ("model that is not XML", ("not a model MuJoCo can compile", "XML"), {"m.xml": "duration = 3"}),
        ("model of negative mass", ("not a model MuJoCo can compile", "mass"),
         swap('mass="7.5"', 'mass="-7.5"', 1)),
        ("model whose mass is nan", ("mass",), swap('mass="7.5"', 'mass="nan"', 1)),
        ("model without a joint", ("joint 'left_knee': missing",),
         model(lambda text: text.replace('<joint name="left_knee" class="knee"/>', "")
               .replace('<motor name="left_knee" joint="left_knee"/>', ""))),
        ("model with a misspelt site", ("site 'left_heel': missing", "'left_hel'"),
         swap('<site name="left_heel"', '<site name="left_hel"')),
        ("model without a contact pair", ("contact pair 'left_toe': missing",),
         swap('<pair name="left_toe" geom1="ground" geom2="left_toe"/>', "")),
        ("model with an unnamed body", ("body", "has no name", "right_shank"),
         swap('<body name="right_shank"', "<body")),
        ("model with an unnamed extra body", ("body", "has no name"),
         swap('<body name="left_foot" pos="0 0 -0.4428">',
              '<body name="left_foot" pos="0 0 -0.4428"><body><inertial pos="0 0 0" mass="1" '
              'diaginertia="0.1 0.1 0.1"/></body>')),
        ("model with an extra body", ("bodies: expected exactly torso", "backpack"),
         swap('<body name="right_thigh"', '<body name="backpack"><inertial pos="0 0 0" mass="1" '
              'diaginertia="0.1 0.1 0.1"/></body><body name="right_thigh"')),
        ("model with joints in another order", ("joints: expected root_x, root_z, root_pitch first", "in this order"),
         model(lambda text: text.replace('"root_x"', '"tmp"').replace('"root_z"', '"root_x"')
               .replace('"tmp"', '"root_z"'))),
        ("model with a joint on the wrong body", ("joint 'right_knee'", "body 'right_shank'"),
         model(lambda text: text.replace('<joint name="right_hip"/>',
                                         '<joint name="right_hip"/><joint name="right_knee" class="knee"/>', 1)
               .replace('<body name="right_shank" pos="0 0 -0.441">\n          '
                        '<joint name="right_knee" class="knee"/>',
                        '<body name="right_shank" pos="0 0 -0.441">'))),
        ("model with a joint about another axis", ("joint 'left_hip': expected axis 0 -1 0",),
         swap('<joint name="left_hip"/>', '<joint name="left_hip" axis="0 1 0"/>')),
        ("model with a geared motor", ("actuator 'left_hip'", "joint 'left_hip'", "gear 1"),
         swap('<motor name="left_hip" joint="left_hip"/>', '<motor name="left_hip" joint="left_hip" gear="50"/>')),
        ("model with crossed motors", ("actuator 'left_hip'", "joint 'left_hip'"),
         swap('<motor name="left_hip" joint="left_hip"/>', '<motor name="left_hip" joint="left_knee"/>')),
        ("model with round feet", ("geom 'left_toe'", "1e-06"),
         swap('<geom name="left_toe" class="sole"', '<geom name="left_toe" class="sole" size="0.02"')),
        ("model whose toe is beside its site", ("geom 'left_toe'", "site"),
         swap('<geom name="left_toe" class="sole" pos="0.2052', '<geom name="left_toe" class="sole" pos="0.3')),
        ("model with raised ground", ("geom 'ground'", "z = 0"),
         swap('<geom name="ground"', '<geom name="ground" pos="0 0 0.1"')),
        ("model with a turned body", ("body 'left_shank'", "parallel"),
         swap('<body name="left_shank"', '<body name="left_shank" euler="0 0.1 0"')),
        ("posture that touches with an unknown point", ("text 'flat'", "'right_to'", "'right_toe'"),
         swap('name="flat" data="right_toe', 'name="flat" data="right_to')),
    )
)  # fmt: skip
