"""`biped policy`: a learned policy's card, written from what its trainer left, and checked."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from biped.base.errors import InputError
from biped.cli.common import DONE, FAILED, answer
from biped.cli.parser import Commands, command_parser, number, take_json, take_trust, whole

if TYPE_CHECKING:
    from biped.show.document import Document

TORCH = (".pt", ".pth", ".jit")
CONVERT = (
    "pip install torch onnx; python -c \"import torch; m = torch.jit.load('policy.pt').eval(); "
    "torch.onnx.export(m, torch.zeros(1, N), 'policy.onnx', dynamo=False)\", with N the numbers that it takes "
    "(docs/your-policy.md)"
)
"""The way from TorchScript to a network that is run here."""


def add(commands: Commands) -> None:
    """Adds the parser of `biped policy`."""
    parser = command_parser(
        commands, "policy", "check the card of a learned policy, or write one", command, simulates=True,
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
        "--rate", type=number, help="for a new card: how often the network is called [Hz], if nothing else says it"
    )
    parser.add_argument(
        "--clock",
        type=number,
        help="for a new card: the frequency of the phase that the network observes [Hz], if nothing else says it",
    )
    parser.add_argument(
        "--tape", type=Path, help="an .npz file of states, observations and actions that the card must reproduce"
    )
    parser.add_argument("--faults", action="store_true", help="inject faults into the card and see which are found")
    parser.add_argument(
        "--right",
        type=whole,
        default=1,
        metavar="N",
        help="with --faults: number of starts from which the correct card is checked",
    )
    parser.add_argument(
        "--measure",
        action="store_true",
        help="measure speed and cost, and the pushes, slopes and latency that the policy withstands",
    )
    take_trust(parser)
    take_json(parser)


def command(args: argparse.Namespace) -> int:
    """Writes a card if there is none, checks it, and says what came of it."""
    from biped.show.policy import checks_document, faults_document, measured_document
    from biped.studies.policy.checks import check, reproduce
    from biped.studies.policy.tape import read_tape

    files = [_card(args, file) for file in args.file]
    if args.faults:
        from biped.studies.policy.faults import trial

        trials = [trial(file, args.right) for file in files]
        _answer(args, [one.as_dict() for one in trials], [faults_document(trials)])
        return DONE
    if args.measure:
        from biped.studies.policy.measure import measure

        rows = [measure(file) for file in files]
        _answer(args, [{"card": str(file), **row._asdict(), "limits": [one._asdict() for one in row.limits]}
                       for file, row in zip(files, rows, strict=True)],
                map(measured_document, files, rows))  # fmt: skip
        return DONE
    checks = [([] if args.tape is None else reproduce(file, read_tape(args.tape))) + check(file) for file in files]
    _answer(args, [{"card": str(file), "checks": [one._asdict() for one in found]}
                   for file, found in zip(files, checks, strict=True)],
            map(checks_document, files, checks))  # fmt: skip
    return DONE if all(one.passed for found in checks for one in found) else FAILED


def _answer(args: argparse.Namespace, cards: list[dict[str, Any]], documents: Iterable[Document]) -> None:
    answer(args, cards[0] if len(cards) == 1 else {"cards": cards}, tuple(chain(*documents)))


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
