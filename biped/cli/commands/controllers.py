"""`biped tune` and `policy`: gains are searched for, and learned policies are checked."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from biped.base.errors import InputError, safe
from biped.base.files import label
from biped.base.writing import may_fill
from biped.cli import common

if TYPE_CHECKING:
    from biped.show.document import Document


def add_tune(commands: common.Commands) -> None:
    """Adds the parser of `biped tune`."""
    parser = common.command_parser(
        commands, "tune", "search for gains that work under the conditions of a scenario", tune_command, simulates=True,
        description="Searches for gains that work under the conditions in the table [tune] of a scenario. With --out "
        "an interrupted search is continued. Given a robot's model file, it then puts what it found to the tests in "
        "scenarios/any/cells, and writes a page.",
    )  # fmt: skip
    parser.add_argument(
        "scenario",
        help="a scenario with a table [tune]: name in scenarios/ or path; or a robot's model file (.xml, .urdf), for "
        "which scenarios/tune/any.toml searches",
    )
    common.take_changes(parser)
    common.take_trust(parser)
    common.take_workers(parser)
    parser.add_argument("--out", type=Path, help="results folder; the same command continues what was interrupted")
    parser.add_argument(
        "--generations", metavar="N", type=common.whole,
        help="end after N generations, with the best gait that was re-checked until then; those of an interrupted "
        "search in --out count (default: what the scenario says)",
    )  # fmt: skip
    least = (
        "instead of a search: put the gains of a found gait back one by one to where its search began, to see which of "
        "them it needs"
    )
    parser.add_argument("--least", metavar="GAIT", help=least)
    alone = "of a robot's model file: end with the gait, without the tests in scenarios/any/cells and their page"
    parser.add_argument("--search-only", action="store_true", help=alone)
    left = "of a robot's model file: a shipped gait that is not tried, such as the robot's own (repeatable)"
    parser.add_argument("--without", metavar="GAIT", action="append", default=[], help=left)
    first = "of a robot's model file: the first stages of the search alone (the first four are of level ground)"
    parser.add_argument("--stages", metavar="N", type=common.whole, help=first)
    common.take_json(parser)


def tune_command(args: argparse.Namespace) -> int:
    """Searches; how the search goes is drawn anew after every re-check."""
    from biped.show.document import Paragraph
    from biped.show.page import write_page
    from biped.show.searches import search_document
    from biped.show.standing import document_of, write
    from biped.studies.tune import tune

    if args.generations is not None and args.generations < 1:
        raise InputError(f"--generations: expected at least 1, got {args.generations}")
    if args.least is not None:
        if args.generations is not None:
            raise InputError("--generations: expected none with --least, which makes no search")
        return _least(args)
    from biped.studies.tune.robot import SCENARIO, is_model, search_of, verdict, with_transitions

    for option, given in (("--search-only", args.search_only), ("--without", args.without), ("--stages", args.stages)):
        if given and not is_model(args.scenario):
            raise InputError(f"{option}: expected a robot's model file, got '{safe(args.scenario)}'")

    with common.workers_of(args) as jobs:
        name, changes = args.scenario, args.changes
        if is_model(name):
            from biped.show.studies import trials_document

            if args.out is not None:  # trials take a minute
                may_fill(args.out, "--out", ("runs.jsonl", "scenario.toml", "result.json"))
            changes, trials = search_of(name, changes, jobs, common.progress, args.without, args.stages)
            if not args.json:
                common.show(trials_document(trials))
            name = SCENARIO
        found = tune(name, changes, jobs, args.out, common.progress, _draw, common.warn, args.generations)
        if name == args.scenario or args.search_only:
            common.answer(args, found.as_dict(), search_document(found))
            return common.DONE
        walk = with_transitions(found.folder / found.gait.name, changes, jobs, common.progress, common.warn)
        stands = verdict(walk, changes, jobs, common.progress, common.warn)
    table, out = stands.table.as_dict(), found.folder / "page.html"
    elsewhere = {name: tested.as_dict() for name, (_, tested) in stands.elsewhere.items()}
    folders = [stands.tests, *(folder for folder, _ in stands.elsewhere.values())]
    document = [*search_document(found)]
    for folder, tested in zip(folders, (table, *elsewhere.values()), strict=True):
        write(tested, folder)
        document += document_of(tested)
    document += [Paragraph(f"not tested in {name}: it is not installed") for name in stands.absent]
    write_page([stands.walk, *folders, found.folder], out, f"A walk for {Path(args.scenario).stem}")
    answer = found.as_dict() | {"standard": table, "elsewhere": elsewhere, "page": label(out)}
    common.answer(args, answer, (*document, Paragraph(f"page in {label(out)}")))
    return common.DONE


def _least(args: argparse.Namespace) -> int:
    """Goes back from a found gait to the scenario's own; the figure is drawn anew after every step."""
    from biped.show.studies import least_document
    from biped.studies.tune.least import least

    with common.workers_of(args) as jobs:
        found = least(
            args.scenario, args.least, args.changes, jobs, args.out, common.progress, _draw_least, common.warn
        )
    common.answer(args, found.as_dict(), least_document(found))
    return common.DONE


def _draw_least(steps: list, folder: Path) -> None:
    from biped.show.figures.studies import plot_least

    plot_least(steps, folder / "least.png")


def _draw(journal: list, folder: Path) -> None:
    from biped.show.figures.studies import plot_search

    if "recheck" in journal[-1]:  # a figure costs as much as a few runs
        plot_search(journal, folder / "convergence.png")


TORCH = (".pt", ".pth", ".jit")
CONVERT = (
    "pip install torch onnx; python -c \"import torch; m = torch.jit.load('policy.pt').eval(); "
    "torch.onnx.export(m, torch.zeros(1, N), 'policy.onnx', dynamo=False)\", with N the numbers that it takes "
    "(docs/your-policy.md)"
)
"""The way from TorchScript to a network that is run here."""


def add_policy(commands: common.Commands) -> None:
    """Adds the parser of `biped policy`."""
    parser = common.command_parser(
        commands, "policy", "check the card of a learned policy, or write one", policy_command, simulates=True,
        description="Checks the card of a learned policy by short runs. Given a network instead, it first writes the "
        "card from the metadata of the ONNX file or from a YAML file.",
    )  # fmt: skip
    parser.add_argument(
        "file",
        type=Path,
        nargs="+",
        help="a card such as card.toml, or several; or a network such as policy.onnx, whose card is written",
    )
    parser.add_argument("--model", help="for a new card: the model of the robot")
    parser.add_argument(
        "--card", type=Path, help="for a new card: its file (default: beside the network, with its name)"
    )
    parser.add_argument(
        "--deploy",
        type=Path,
        help="for a new card: Unitree's deploy.yaml or Isaac Lab's IO descriptors (default: metadata of the network)",
    )
    parser.add_argument(
        "--rate",
        type=common.number,
        help="for a new card: how often the network is called [Hz], if nothing else says it",
    )
    parser.add_argument(
        "--clock",
        type=common.number,
        help="for a new card: the frequency of the phase that the network observes [Hz], if nothing else says it",
    )
    parser.add_argument(
        "--tape", type=Path, help="an .npz file of states, observations and actions that the card must reproduce"
    )
    parser.add_argument("--faults", action="store_true", help="inject faults into the card and see which are found")
    parser.add_argument(
        "--right",
        type=common.whole,
        default=1,
        metavar="N",
        help="with --faults: number of starts from which the correct card is checked",
    )
    parser.add_argument(
        "--measure",
        action="store_true",
        help="measure speed and cost, and the pushes, slopes and latency that the policy withstands",
    )
    common.take_trust(parser)
    common.take_json(parser)


def policy_command(args: argparse.Namespace) -> int:
    """Writes a card if there is none, checks it, and says what came of it."""
    from biped.show.studies import checks_document, faults_document, measured_document
    from biped.studies.policy import check, reproduce
    from biped.studies.policy.tape import read_tape

    files = [_card(args, file) for file in args.file]
    if args.faults:
        from biped.studies.policy.trials import trial

        trials = [trial(file, args.right) for file in files]
        _answer(args, [one.as_dict() for one in trials], [faults_document(trials)])
        return common.DONE
    if args.measure:
        from biped.studies.policy.trials import measure

        rows = [measure(file) for file in files]
        _answer(args, [{"card": str(file), **row._asdict(), "limits": [one._asdict() for one in row.limits]}
                       for file, row in zip(files, rows, strict=True)],
                map(measured_document, files, rows))  # fmt: skip
        return common.DONE
    checks = [([] if args.tape is None else reproduce(file, read_tape(args.tape))) + check(file) for file in files]
    _answer(args, [{"card": str(file), "checks": [one._asdict() for one in found]}
                   for file, found in zip(files, checks, strict=True)],
            map(checks_document, files, checks))  # fmt: skip
    return common.DONE if all(one.passed for found in checks for one in found) else common.FAILED


def _answer(args: argparse.Namespace, cards: list[dict[str, Any]], documents: Iterable[Document]) -> None:
    common.answer(args, cards[0] if len(cards) == 1 else {"cards": cards}, tuple(chain(*documents)))


def _card(args: argparse.Namespace, file: Path) -> Path:
    """A card that is there, or the one that is written for a network."""
    if file.suffix == ".onnx":
        return _written(args, file)
    if file.suffix in TORCH:
        raise InputError(
            f"policy: {file}: TorchScript, which biped does not run; convert it once, where PyTorch is: {CONVERT}"
        )
    if file.suffix != ".toml" or not file.is_file():
        raise InputError(f"policy: {file}: expected a card that is there, card.toml, or a network, policy.onnx")
    return file


def _written(args: argparse.Namespace, file: Path) -> Path:
    """The card that is written for a network."""
    import tomli_w

    from biped.studies.policy.describe import describe

    out = args.card or file.with_suffix(".toml")
    if out.exists():
        raise InputError(f"policy: {out}: is there already; nothing is overwritten: check it with biped policy {out}")
    if out.resolve().parent != file.resolve().parent:
        raise InputError(f"--card: {out}: expected a file beside the network {file}")
    if args.model is None:
        raise InputError("--model: expected the robot's model file, such as --model scene.xml")
    text = tomli_w.dumps(describe(file, args.model, args.deploy, args.rate, args.clock))
    out.write_text(text, encoding="utf-8")
    return out
