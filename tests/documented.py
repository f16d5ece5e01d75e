"""Commands of the documentation, page by page, and how each is made short enough for a test."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path

from biped.cli.main import parsed
from biped.ensemble.plan import Plan
from biped.studies.run import plan_of

ROOT = Path(__file__).parents[1]
PAGES = [
    page
    for page in sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
    if not page.name.endswith(".in.md")  # the page that is made of it has its words
]
HISTORY = (ROOT / "CHANGELOG.md",)
"""Pages that tell what changed, refusals among it: their commands are parsed, but nobody types them in their order."""
_CODE = re.compile(
    r"```(?P<language>\w*)\n(?P<block>.*?)```|`(?P<inline>(?:biped [^`]+|make|python -m) [^`]+)`"
    r"|^ {4,}(?P<indented>\S[^\n]*)$",
    re.DOTALL | re.MULTILINE,
)
SHELL = ("biped", "make", "python", "pip", "dask")
"""Programs that pages name; a line of shell begins with one of them."""

PLACEHOLDERS = {
    "SCENARIO": "demo/push", "RUN": "results", "A": "before", "B": "after", "BEFORE": "before", "AFTER": "after",
    "DIR": "figures", "GAIT": "whole", "ROBOT.xml": "my_robot.xml", "NAME": "level_fast", "tuned/NAME": "tuned/level",
    "my/scenario.toml": "my_scenario.toml",
}  # fmt: skip
"""Words in capitals of a command, and what a reader may write for them."""
SHORTER = {
    r"^(certify|find) SCENARIO": r"\1 upright/own", r"^run FILE": "run robust/slope",
    r"^model FILE": "model my_robot.xml", r"--mcap FILE": "--mcap walk.mcap",
    r"--only 17": "--only 1", r"--reference 100": "--reference 2", r"--right 15": "--right 1",
    r"--most 300": "--most 20", r"local:8": "local:1", r"\$seed": "1",
    r"^bench (mechanisms|throughput|campaigns)$": r"bench \1 --quick", r"^bench policy": "bench policy --quick",
    r"^regress( --markdown)?$": r"regress ci/level\1",
    r"^regress --update": "regress ci/level --file mine.json --update",
}  # fmt: skip
"""Parts of commands that are long, change the repository or name what a test has not, and what replaces them."""
FEWER = {
    "certify": ["--most", "200", "--method", "counting", "--set", "duration=1"],
    "find": ["--most", "200", "--failures", "1", "--set", "duration=1"],
    "readings": ["--tries", "1", "--confirm", "1"],
    "standard": ["--set", "randomise.runs=1"],
    "video": ["--fps", "2"],
    "tune": [f"--set=tune.{change}" for change in (
        "stages=[]", "generations=1", "population=4", "recheck=1", "checks=1", "finalists=1", "unseen=1")],
}  # fmt: skip
"""Options that make a command short, by its name."""

MINUTES = (
    "bench campaigns", "bench campaigns --quick", "bench tolerances --out DIR", "bench walking --out figures",
    "stability --growth policy/h1", "stability calm/own", "stability level_slow_generalized",
    "stability robust/own --engine home --basin", "stability spatial/own --norm", "stability upright/own",
    "standard my_gait.toml --atlas --out runs/mine", "standard normal fast slow --atlas --set reading=plastic",
    "standard card.toml --atlas --set command.forward=0.5 --trust --out runs/card",
    "standard robot --atlas --set model=robot --set ground.friction=1.0", "standard whole robust --atlas",
    "tune ROBOT", "tune my_robot.xml", "tune my_robot.xml --out runs/mine", "tune my_robot.xml --stages 4",
    "tune my_robot.xml --search-only --stages 4 --without any/g1 --set seed=5 --out runs/mine_5",
    "tune my_robot.xml --without any/xbot --set seed=7 --out runs/mine",
    "tune tune/pushing --least calm", "tune tune/pushing --least calm --out back",
)  # fmt: skip
"""Commands that are not executed because each takes more than a minute of CPU even with fewer runs."""
SKIPPED: dict[str, tuple[str, str]] = {
    "view": ("window", "waits until a viewer is closed"),
    "--live": ("window", "opens a window"),
    "worker": ("cluster", "joins a scheduler; tests/ensemble/cluster has one"),
    "--cluster tcp:": ("cluster", "the same"),
    "SLURM_ARRAY_TASK_ID": ("cluster", "is a share of a batch job; tests/ensemble/cluster has stand-ins"),
    "drake": ("pydrake", "needs Drake"),
    "bench engines": ("pydrake", "needs Drake"),
}
"""Commands that are not executed, by a part of them: a kind of reason, or a package that is missing; and the reason."""


def shell(page: Path) -> list[str]:
    """Every line of shell on a page in its order: of blocks, and between backquotes."""
    lines = []
    for found in _CODE.finditer(page.read_text(encoding="utf-8")):
        if found["inline"] or found["indented"]:
            lines.append(found["inline"] or found["indented"])
        elif found["language"] == "sh":
            lines += found["block"].splitlines()
    parts = [part.strip() for line in lines for part in " ".join(line.split()).split(" && ")]
    ours = [part for part in parts if part.removeprefix(".venv/bin/").startswith(SHELL)]
    return [part for part in ours if "…" not in part.partition(" #")[0]]


def commands(page: Path) -> list[str]:
    """Every `biped …` of a page in its order, once, without the word biped and without comments."""
    found = []
    for line in shell(page):
        words = shlex.split(line, comments=True)
        if words[0].split("/")[-1] == "biped" and len(words) > 1 and not words[1].startswith("--"):
            found.append(shlex.join(words[1:]))
    return list(dict.fromkeys(found))


def skipped(command: str) -> str | None:
    """The part of `SKIPPED` that a command has."""
    return next((part for part in SKIPPED if re.search(rf"(?<![\w/]){re.escape(part)}(?![\w-])", command)), None)


def short(command: str, furnish: Callable[[list[str]], None]) -> list[list[str]]:
    """The words of a documented command with fewer runs; of one with several scenarios a command for each.

    Args:
        command: As it stands on its page.
        furnish: Puts there what the command takes for granted; it is called before scenarios are read.
    """
    for long, brief in SHORTER.items():
        command = re.sub(long, brief, command)
    words = []
    for word in (PLACEHOLDERS.get(word, word) for word in shlex.split(command)):
        words += sorted(str(p.relative_to(ROOT)) for p in ROOT.glob(word)) if "*" in word else [word]
    words += [] if "--reference" in words else FEWER.get(words[0], [])
    if words[0] == "standard" and not {"--test", "--atlas"} & set(words):
        words += ["--test", "push_forward"]
    furnish(words)
    args = parsed(words)
    jobs = ["--jobs", "1"] if hasattr(args, "jobs") and args.cluster is None else []
    if (
        words[0] not in ("run", "check", "compare", "diff")
        or not args.scenario
        or getattr(args, "only", None) is not None
    ):
        return [[*words, *jobs]]
    names = args.scenario if isinstance(args.scenario, list) else [args.scenario]
    out = []
    for name in names:
        others = [word for word in words if word == name or word not in names or words[0] == "diff"]
        out.append([*others, *fewer(plan_of(name, args.changes)), *jobs])
    return out


def fewer(plan: Plan) -> list[str]:
    """Options that leave a campaign two runs, or a run at each of the first two values of what it sweeps."""
    sweep = [f"{json.dumps(key)}={json.dumps(values[:2])}" for key, values in plan.scenario.sweep.items()]
    if sweep:
        return ["--set", "randomise.runs=1", "--set", f"sweep={{{', '.join(sweep)}}}"]
    return ["--set", "randomise.runs=2"] if len(plan) > 2 else []
