"""Models that mean harm: each ends in one paragraph, before or instead of what it would do to this process."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import mujoco
import pytest

from biped.base.errors import InputError
from biped.base.files import folder
from biped.robot import safety
from biped.robot.planar import model as models
from biped.robot.planar.model import spec_of, tree_at
from biped.robot.safety import examine, packaged
from tests.bad import HUMAN

KEYS = HUMAN[HUMAN.index("<keyframe>") : HUMAN.index("</keyframe>") + len("</keyframe>")]


def put(old: str, new: str) -> str:
    assert old in HUMAN
    return HUMAN.replace(old, new, 1)


def asset(text: str) -> str:
    return put("<worldbody>", f"<asset>{text}</asset><worldbody>")


def world(text: str) -> str:
    return put("<light", f"{text}<light")


def nested(element: str, count: int) -> str:
    return f"<{element}>" * count + f"</{element}>" * count


def png(width: int, height: int) -> bytes:
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sII", 13, b"IHDR", width, height) + b"\x08\x02\x00\x00\x00"


MANY = '<replicate count="1000" offset="0 0 1">' * 2 + '<geom size=".1"/>' + "</replicate>" * 2
GRID = '<flexcomp name="f" type="grid" count="500 500 500" spacing=".1 .1 .1" dim="3"/>'
HARMFUL = {
    "itself as an asset": (asset('<model name="x" file="m.xml"/>'), "<model>: not taken"),
    "replicate": (world(MANY), "<replicate>: not taken"),
    "composite": (world('<composite type="cable" count="99999 1 1"/>'), "<composite>: not taken"),
    "flexcomp": (world(GRID), "<flexcomp>: not taken"),
    "attach": (world('<attach model="x" body="torso"/>'), "<attach>: not taken"),
    "extension": (put("<worldbody>", '<extension><plugin plugin="p"/></extension><worldbody>'), "<extension>: not"),
    "include of nothing": (put(KEYS, '<include file="none.xml"/>'), "include: no file 'none.xml'"),
    "include of nothing named": (put(KEYS, "<include/>"), "m.xml"),
    "include of a FIFO": (put(KEYS, '<include file="fifo"/>'), "expected a regular file"),
    "include of a device": (put(KEYS, '<include file="/dev/zero"/>'), "in the folder of the model"),
    "include from outside": (put(KEYS, '<include file="../outside.xml"/>'), "in the folder of the model"),
    "include through a link": (put(KEYS, '<include file="link.xml"/>'), "in the folder of the model"),
    "include of itself": (put(KEYS, '<include file="m.xml"/>'), "in a circle"),
    "include in a circle": (put(KEYS, '<include file="a.xml"/>'), "in a circle"),
    "include twice": (put(KEYS, '<include file="b.xml"/><include file="b.xml"/>'), "included twice"),
    "include of a huge file": (put(KEYS, '<include file="huge.xml"/>'), "at most 4 MB"),
    "texture": (asset('<texture name="x" type="2d" builtin="flat" width="60000" height="60000"/>'), "pixels"),
    "cube texture": (asset('<texture name="x" type="cube" builtin="flat" width="9000"/>'), "pixels"),
    "many textures": (
        asset("".join(f'<texture name="{i}" builtin="flat" width="3000" height="3000"/>' for i in "ab")), "pixels"
    ),
    "texture of a bomb": (asset('<texture name="x" type="2d" file="bomb.png"/>'), "pixels"),
    "texture of a bomb elsewhere": (
        put("<worldbody>", '<compiler texturedir="deep"/><asset><texture name="x" type="2d" file="bomb2.png"/></asset>'
            "<worldbody>"), "pixels",
    ),
    "texture of a FIFO": (asset('<texture name="x" type="2d" file="fifo"/>'), "regular file"),
    "mesh from outside": (asset('<mesh name="x" file="/dev/zero"/>'), "in the folder of the model"),
    "huge mesh": (asset('<mesh name="x" file="huge.stl"/>'), "at most 64 MB"),
    "height field": (asset('<hfield name="x" nrow="60000" ncol="60000" size="1 1 1 1"/>'), "pixels"),
    "elements too deep": (put("<default>", nested("default", 20_000) + "<default>"), "64 deep"),
    "too many elements": (world('<site size="1"/>' * 20_000), "at most 20000 elements"),
    "too large": (HUMAN + " " * 4_000_000, "at most 4 MB"),
    "billion laughs": (
        "<!DOCTYPE m [<!ENTITY a 'ha'><!ENTITY b '&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;'>]>"
        + put('"head"', '"&b;"'), "<!DOCTYPE>",
    ),
    "external entity": ("<!DOCTYPE m [<!ENTITY a SYSTEM '/etc/passwd'>]>" + HUMAN, "<!DOCTYPE>"),
    "other encoding": ("<?xml version='1.0' encoding='utf-16'?>" + HUMAN[:-20], "not XML"),
    "robot description": ("<robot name='r'><link name='l'/></robot>", "body 'torso': missing"),
    "posture of nan": (put('qpos="0 1.27', 'qpos="nan 1.27'), "expected finite numbers, got nan"),
    "posture of infinity": (put('qpos="0 1.27', 'qpos="0 -Inf'), "expected finite numbers, got -Inf"),
    "overflowing number": (put('qpos="0 1.27', 'qpos="0 1e999'), "expected finite numbers, got 1e999"),
    "name over 255 bytes": (put('"head"', f'"{"h" * 300}"'), "at most 255 bytes, got 300"),
    "file name over 255 bytes": (asset(f'<mesh name="x" file="{"h" * 300}.stl"/>'), "at most 255 bytes"),
    "escapes in a name": (put('"head"', '"&#x9b;31m"'), "printable characters"),
    "all memory": (put("<default>", '<size memory="900G"/><default>'), "memory: expected at most 256M"),
    "endless iterations": (put("<option ", '<option noslip_iterations="2000000000" '), "at most 10000 iterations"),
    "a mass of nearly nothing": (put('mass="7.5"', 'mass="1e-18"'), "right_thigh"),
    "a mass below sense": (put('mass="7.5"', 'mass="1e-12"'), "body 'right_thigh': mass: expected 1e-06"),
    "a mass beyond sense": (put('mass="7.5"', 'mass="2e6"'), "body 'right_thigh': mass: expected 1e-06"),
    "a leg beyond sense": (put('pos="0 0 -0.441"', 'pos="0 0 -2000"'), "body 'right_shank': place"),
    "a posture beyond sense": (put('qpos="0 1.27', 'qpos="0 1e9'), "key 'heel_toe': qpos"),
}  # fmt: skip


@pytest.fixture
def put_down(tmp_path, monkeypatch):
    """Writes m.xml and all that the cases refer to; yields its path."""
    (tmp_path / "outside.xml").write_text(f"<mujocoinclude>{KEYS}</mujocoinclude>", encoding="utf-8")
    root = tmp_path / "model"
    (root / "deep").mkdir(parents=True)
    monkeypatch.chdir(root)
    os.mkfifo("fifo")
    Path("link.xml").symlink_to("../outside.xml")
    Path("a.xml").write_text('<mujocoinclude><include file="deep/c.xml"/></mujocoinclude>', encoding="utf-8")
    Path("deep/c.xml").write_text('<mujocoinclude><include file="a.xml"/></mujocoinclude>', encoding="utf-8")
    Path("b.xml").write_text("<mujocoinclude/>", encoding="utf-8")
    for name in ("bomb.png", "deep/bomb2.png"):
        Path(name).write_bytes(png(60_000, 60_000))
    for name in ("huge.xml", "huge.stl"):
        with open(name, "wb") as file:
            file.truncate(65_000_000)

    def write(text: str) -> Path:
        Path("m.xml").write_text(text, encoding="utf-8")
        return Path("m.xml").resolve()

    return write


@pytest.mark.parametrize("name", HARMFUL)
def test_a_harmful_model_is_refused(name, put_down):
    text, says = HARMFUL[name]
    with pytest.raises(InputError) as error:
        spec_of(put_down(text))
    assert says in str(error.value)
    assert len(str(error.value)) < 1000


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("itself as an asset", "crashes MuJoCo or Pinocchio (SIGSEGV)"),
        ("elements too deep", "not a model MuJoCo can compile"),
        ("flexcomp", "takes more than 2048 MB"),
        ("texture", "allocate memory"),
        ("all memory", "allocate memory"),
    ],
)
def test_what_is_not_known_to_be_harmful_does_its_harm_elsewhere(name, says, put_down, monkeypatch):
    """Were the list of tricks empty, the process that tries a model would still take the harm."""
    monkeypatch.setattr(models, "examine", lambda path: None)
    monkeypatch.setattr(safety, "MOST_SECONDS", 60)  # so that a busy machine does not run into this limit first
    with pytest.raises(InputError, match=r"m\.xml") as error:
        spec_of(put_down(HARMFUL[name][0]))
    assert says in str(error.value)


def test_work_that_takes_too_long_is_ended(monkeypatch):
    monkeypatch.setattr(safety, "MOST_SECONDS", 1)

    def busy() -> None:
        while True:
            pass

    with pytest.raises(InputError, match="w: took more than 1 s to compile"):
        safety.tried("w", busy)


def test_work_that_waits_for_ever_is_ended(put_down, monkeypatch):
    monkeypatch.setattr(models, "examine", lambda path: None)
    monkeypatch.setattr(safety, "MOST_WAIT", 1.0)
    path = put_down(HARMFUL["include of a FIFO"][0])
    with pytest.raises(InputError, match="waiting for something"):
        spec_of(path)


def test_work_leaves_no_process_and_no_trace_here(capfd):
    said = []

    def work() -> None:
        said.append(1)
        os.write(1, b"printed")
        os.write(2, b"written")
        raise SystemExit(3)

    before = len(os.listdir("/proc/self/fd"))
    with pytest.raises(InputError, match="w: cannot be used: SystemExit: 3"):
        safety.tried("w", work)
    assert said == []
    assert capfd.readouterr() == ("", "")
    assert len(os.listdir("/proc/self/fd")) == before
    with pytest.raises(ChildProcessError):
        os.waitpid(-1, os.WNOHANG)


BENIGN = {
    "the human model": HUMAN,
    "postures in a file of their own": put(KEYS, '<include file="deep/keys.xml"/>'),
    "a mesh and a texture": asset(
        '<mesh name="x" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/>'
        '<texture name="t" type="2d" builtin="checker" width="512" height="512"/>'
    ),
    "names like numbers": put('name="head"', 'name="inf"').replace('"trunk"', '"nan"'),
    "a declaration and comments": '<?xml version="1.0" encoding="utf-8"?>\n<!-- häßlich -->' + HUMAN,
}


@pytest.mark.parametrize("name", BENIGN)
def test_a_model_that_means_well_is_taken_as_it_is(name, put_down):
    Path("deep/keys.xml").write_text(f"<mujocoinclude>{KEYS}</mujocoinclude>", encoding="utf-8")
    path = put_down(BENIGN[name])
    assert spec_of(path).compile().nv == 9
    for mine, theirs in zip(tree_at(path), tree_at(folder("models") / "human.xml"), strict=True):
        assert (mine == theirs).all()


def test_the_packages_models_are_spared_and_others_are_tried_once(put_down, monkeypatch):
    tried = []
    monkeypatch.setattr(models, "tried", lambda name, work: tried.append(name))
    monkeypatch.setattr(models, "examine", tried.append)
    models._checked.cache_clear()
    assert packaged(folder("models") / "human.xml")
    spec_of(folder("models") / "human.xml")
    assert tried == []
    path = put_down(HUMAN)
    for _ in range(3):
        spec_of(path)
        tree_at(path)
    assert tried == [path, "m.xml"]


def test_the_bounds_are_far_from_the_human_model(put_down):
    assert 100 * len(HUMAN) < safety.MOST_BYTES
    assert 50 * HUMAN.count("<") < safety.MOST_ELEMENTS * 2
    assert mujoco.MjModel.from_xml_string(HUMAN).body_mass[1:].min() > 1.0
    examine(put_down(HUMAN))
