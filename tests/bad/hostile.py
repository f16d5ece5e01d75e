"""Input that means harm, or says more than a machine holds."""

from __future__ import annotations

from tests.bad.commands import set_
from tests.bad.kind import Bad

BOUNDS = (
    *(Bad(f"{key} = {value}"[:60], (f"s.toml: {key}: expected", *says), f"{key} = {value}")
    for key, value, says in (
        ("sensors.delay", "1e9", ("<= 1000",)),
        ("sensors.delay", "500.0", ("at most 100 s",)),
        ("sensing.heel_on", "1e9", ("<= 1000",)),
        ("simulation.iterations", "2000000000", ("<= 10000",)),
        ("simulation.timestep", "1e-300", (">= 1e-07",)),
        ("simulation.control_rate", "1e-300", (">= 1",)),
        ("duration", "0.0004", ("at least", "got 0.0004")),
        ("ground.contact_time", "0.0019", ("two time steps (0.002 s)", "got 0.0019")),
        ("ground.friction", "1e300", ("<= 1e+06",)),
        ("actuation.torque_limit", "1e300", ("<= 1e+15",)),
        ("seed", "9223372036854775808", ("fewer digits",)),
        ("seed", "0x" + "f" * 5000, ("fewer digits", "20000 bits")),
        ("duration", "1" + "0" * 400, ("fewer digits", "bits")),
        ("randomise.runs", "1000001", ("<= 1e+06",)),
        ("description", "'" + "x" * 5000 + "'", ("length <= 4000",)),
    )),
    Bad("mass of nothing", ("s.toml: truth.mass[3]: expected", ">= 1e-06"), "truth.mass = [1, 1, 1, 1e-18, 1, 1, 1]"),
    Bad("product of factors that is nothing", ("s.toml: truth: right_foot: expected", "moment of inertia"),
        "truth.mass = [1, 1, 1, 1e-6, 1, 1, 1]\ntruth.length = [1, 1, 1, 1e-4, 1, 1, 1]"),
    Bad("speed beyond all bounds", ("s.toml: start.v[2]: expected", "<= 1e+15"),
        "start.v = [0, 0, 1e300, 0, 0, 0, 0, 0, 0]"),
    Bad("sweep of more points than runs can be", ("s.toml: sweep: expected at most 1000000 runs", "100000000"),
        f"[sweep]\n'ground.slope' = {[0.0] * 10_000}\n'ground.friction' = {[1.0] * 10_000}"),
    Bad("points times runs", ("s.toml: sweep: expected at most 1000000 runs", "2000000"),
        "randomise.runs = 1000000\nsweep.'ground.slope' = [0.0, 1.0]"),
    Bad("contacts below two steps with another integrator", ("s.toml: ground.contact_time: expected",),
        "ground.contact_time = 0.001\nsimulation.integrator = 'implicitfast'"),
    Bad("list of a million", ("s.toml: start.q: expected", "got"), f"start.q = {[0.0] * 50_000}"),
    Bad("too many pushes", ("s.toml: push: expected", "<= 100"),
        f"push = [{', '.join(['{at = 0, duration = 1, force = [0, 0]}'] * 101)}]"),
)  # fmt: skip

DEEP = (
    Bad("deep lists", ("s.toml: not a TOML file: expected at most 32",), "push = " + "[" * 5000 + "]" * 5000),
    Bad("deep tables", ("s.toml: not a TOML file: expected at most 32",),
        "ground = " + "{a = " * 3000 + "1" + "}" * 3000),
    Bad("long key", ("s.toml: not a TOML file: expected keys of at most 32",), "a." * 200_000 + "a = 1"),
    Bad("a little too deep", ("s.toml: not a TOML file: expected at most 32",),
        "ground = " + "{a = " * 40 + "1" + "}" * 40),
    Bad("number of 5,000 digits", ("s.toml: not a TOML file: expected numbers of fewer digits",),
        "seed = " + "9" * 5000),
    Bad("huge file", ("s.toml: expected a file of at most 1000 kB",), "# " + "x" * 1_000_000),
    Bad("chain of 1,500 files", ("s.toml: extends: expected at most 32 files",), 'extends = "1.toml"',
        files={f"{i}.toml": f'extends = "{i + 1}.toml"' for i in range(1, 1500)}),
    Bad("name no file can have", ("s.toml: model: no model", "expected"), f'model = "{"x" * 3000}.xml"'),
    Bad("name with a zero in it", ("s.toml: controller: no controller 'a\\x00b.toml'",),
        'controller = "a\\u0000b.toml"'),
    Bad("scenario no file can have", ("no scenario 'xxx",), argv=("run", "x" * 3000)),
    Bad("change of a deep key", ("--set a.a.a", "at most 32 parts"), argv=set_("a." * 10_000 + "a=1")),
    Bad("change to a deep value", ("--set push=[[[", "TOML"), argv=set_("push=" + "[" * 9000)),
    Bad("change to 5,000 digits", ("--set: seed: expected", "got a string"), argv=set_("seed=" + "9" * 5000)),
    Bad("change of several lines", ("--set seed=1", "several lines"), argv=set_("seed=1\nduration=2")),
    Bad("number of runs of 5,000 digits", ("--only: expected a whole number",),
        argv=("run", "s.toml", "--only", "9" * 5000)),
)  # fmt: skip

DRAWS = (
    Bad("one impossible draw of many", ("s.toml: randomise.draw, run 87: ground.friction = -0.0075", ">= 0"),
        'randomise.runs = 100\nrandomise.draw."ground.friction" = { normal = [1.0, 0.35] }'),
    Bad("draw over all numbers there are", ('s.toml: randomise.draw."ground.slope".uniform[0]: expected', "-1e+15"),
        'randomise.draw."ground.slope" = { uniform = [-1.7e308, 1.7e308] }'),
    Bad("draw of contacts below two steps", ("s.toml: randomise.draw, run ", "ground.contact_time", "two time steps"),
        'randomise.runs = 50\nrandomise.draw."ground.contact_time" = { uniform = [0.001, 0.01] }'),
    Bad("draw of a start out of reach", ("s.toml: randomise.draw, run ", "start.posture = 'flatt'"),
        'randomise.runs = 40\nrandomise.draw."start.posture" = { choice = ["flat", "flat", "flat", "flatt"] }'),
    Bad("grid that ends badly", ("s.toml: randomise.draw, run 2: ground.friction = -1.0",),
        'randomise.runs = 40\nrandomise.draw."ground.friction" = { grid = [1.0, 2.0, -1.0] }'),
    Bad("point that is impossible with a draw", ("s.toml: randomise.draw, run ", "push[0].at"),
        "push = [{at = 1.0, duration = 0.1, force = [1.0, 0.0]}]\nrandomise.runs = 20\n"
        'sweep.duration = [10.0, 2.5]\nrandomise.draw."push.0.at" = { uniform = [2.0, 3.0] }'),
    Bad("draw on the command line", ("--set: randomise.draw, run ", "ground.friction"),
        argv=set_("randomise.runs=50", 'randomise.draw={"ground.friction"={normal=[1.0,0.5]}}')),
)  # fmt: skip

ESCAPES = "\\u001b]0;owned\\u0007\\u001b[2J\\u202e"

WORDS = (
    Bad("escapes in a name", ("s.toml: model: no model '\\x1b]0;owned\\x07",), f'model = "{ESCAPES}"'),
    Bad("escapes in a key", ("s.toml: \\x1b]0;owned", "unknown key"), f'"{ESCAPES}" = 1'),
    Bad("escapes in a metric", ("s.toml: expect.\\x1b]0;owned", "unknown metric"),
        f'expect."{ESCAPES}" = {{ min = 1 }}'),
    Bad("escapes in a choice", ("s.toml: engine: expected one of", "'\\x1b]0;owned"), f'engine = "{ESCAPES}"'),
    Bad("escapes in what varies", ('s.toml: sweep."\\x1b]0;owned', "no key"), f'sweep."{ESCAPES}" = [1]'),
    Bad("endless key", ("s.toml: xxxxx", "unknown key"), f"{'x' * 3000} = 1"),
    Bad("endless word", ("s.toml: engine: expected one of", "xxx…xxx"), f"engine = '{'x' * 3000}'"),
    Bad("endless list", ("s.toml: sweep.\"ground.slope\": expected a list",), f"sweep.'ground.slope' = [{[1] * 3000}]"),
)  # fmt: skip
