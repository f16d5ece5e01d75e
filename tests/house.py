"""Counts of the package that its order is judged by: lines, imports, names, branches, look-ups.

`python -m tests.house` prints them as a Markdown table; tests/test_house.py holds them within bounds that only tighten.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

PACKAGE = Path(__file__).parents[1] / "biped"
CHAPTER = "dynamics"
"""The room that is a library of its own."""
SHORT = 30
"""[lines] A module below this is short."""
VAGUE = {"told", "said", "seen", "made", "kept", "given", "asked", "shown"}
"""Names that say nothing about what they name."""
KINDS = {"Trajectory", "GeneralTrajectory", "SevenLinks", "Spatial", "Planar", "Tree"}
"""Classes whose isinstance is a branch on the kind of robot."""
WORDS = {"general", "planar", "spatial", "is_general", "is_planar", "is_spatial"}
"""Names whose truth is a branch on the kind of robot."""
RESOLVED = {"Path", "Scenario", "Ground", "Truth"}
"""Types of what a run has resolved: a function of robot/ that takes one first is a look-up."""
MAKERS = ("ensemble/plan.py", "ensemble/midwalk.py")
"""Modules that make runs, and so may look things up."""


class Module(NamedTuple):
    """A parsed module.

    Attributes:
        path: Relative to the package, with forward slashes.
        lines: Its lines.
        tree: Its syntax tree.
    """

    path: str
    lines: list[str]
    tree: ast.Module

    @property
    def room(self) -> str:
        """The folder of the package that it lies in; of a module at the package's root, its name."""
        return self.path.partition("/")[0]

    @property
    def plant(self) -> bool:
        """Whether it steps one kind of robot in compiled code, and so may know which."""
        return re.match(r"engines/(.*/)?(planar|spatial|rigid)(/|\.py)", self.path) is not None


class House:
    """The package as a whole.

    Args:
        package: Its folder.
    """

    def __init__(self, package: Path = PACKAGE):
        self.modules = [_module(file, package) for file in sorted(package.rglob("*.py"))]
        self.harness = [module for module in self.modules if module.room != CHAPTER]

    @cached_property
    def lines(self) -> int:
        """Lines without the chapter's library."""
        return sum(len(module.lines) for module in self.harness)

    @cached_property
    def imports(self) -> float:
        """Share of all lines that belong to import statements, in percent."""
        count = 0
        for module in self.modules:
            for node in ast.walk(module.tree):
                if isinstance(node, ast.Import | ast.ImportFrom):
                    count += (node.end_lineno or node.lineno) - node.lineno + 1
        return round(100.0 * count / sum(len(module.lines) for module in self.modules), 1)

    @cached_property
    def short(self) -> list[str]:
        """Modules below `SHORT` lines; the one line of words of a package is no module."""
        return [
            m.path
            for m in self.modules
            if len(m.lines) < SHORT and not (m.path.endswith("__init__.py") and len(m.tree.body) < 2)
        ]

    @cached_property
    def ambiguous(self) -> list[str]:
        """Names of classes that stand more than once."""
        names = Counter(
            node.name for module in self.modules for node in ast.walk(module.tree) if isinstance(node, ast.ClassDef)
        )
        return sorted(name for name, count in names.items() if count > 1)

    @cached_property
    def what(self) -> list[str]:
        """Docstrings that begin with "What"."""
        found = []
        for module in self.modules:
            for node in ast.walk(module.tree):
                if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                    text = ast.get_docstring(node) or ""
                    if text.startswith("What"):
                        found.append(f"{module.path}: {text.splitlines()[0]}")
        return found

    @cached_property
    def vague(self) -> list[str]:
        """Functions, classes and modules whose name is one of `VAGUE`, or begins or ends with one."""
        found = [m.path for m in self.modules if VAGUE & set(Path(m.path).stem.split("_"))]
        for module in self.modules:
            for node in ast.walk(module.tree):
                if isinstance(node, ast.FunctionDef | ast.ClassDef) and VAGUE & set(node.name.lower().split("_")):
                    found.append(f"{module.path}: {node.name}")
        return found

    @cached_property
    def branches(self) -> list[str]:
        """Branches on the kind of robot outside robot/ and the plants."""
        found = []
        for module in self.harness:
            if module.room != "robot" and not module.plant:
                found += [f"{module.path}:{node.lineno}" for node in ast.walk(module.tree) if _on_kind(node)]
        return found

    @cached_property
    def lookups(self) -> list[str]:
        """Calls of functions of robot/ that look up what a run carries, from whoever has a run."""
        names = {
            node.name
            for module in self.modules
            if module.room == "robot"
            for node in module.tree.body
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_") and _takes(node) & RESOLVED
        }
        rooms = {"control", "engines", "measure", "ensemble", "studies", "show"}
        found = []
        for module in self.modules:
            if module.room not in rooms or module.path in MAKERS:
                continue
            known = names & {name for source, name in _imported(module) if source.startswith("biped.robot")}
            found += [
                f"{module.path}:{node.lineno} {node.func.id}"
                for node in ast.walk(module.tree)
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in known
            ]
        return found


def _module(file: Path, package: Path) -> Module:
    text = file.read_text(encoding="utf-8")
    return Module(file.relative_to(package).as_posix(), text.splitlines(), ast.parse(text))


def _imported(module: Module) -> Iterator[tuple[str, str]]:
    """Modules from which a module imports names, and the names."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.ImportFrom):
            yield from ((node.module or "", one.name) for one in node.names)


def _takes(function: ast.FunctionDef) -> set[str]:
    """Types of a function's arguments, as they are written."""
    return {ast.unparse(one.annotation) for one in function.args.args if one.annotation is not None}


def _on_kind(node: ast.AST) -> bool:
    """Whether a node is a question for the kind of robot."""
    if isinstance(node, ast.Compare):
        left, operator, right = node.left, node.ops[0], node.comparators[0]
        nothing = isinstance(right, ast.Constant) and right.value is None
        robot = isinstance(left, ast.Attribute) and left.attr in ("robot", "seven_links")
        return robot and nothing and isinstance(operator, ast.Is | ast.IsNot)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "isinstance":
        return bool(KINDS & set(re.findall(r"\w+", ast.unparse(node.args[1]))))
    if isinstance(node, ast.If | ast.IfExp):
        return any(name in WORDS for name in _truths(node.test))
    return False


def _truths(test: ast.expr) -> Iterator[str]:
    """Names whose truth a condition asks for."""
    if isinstance(test, ast.BoolOp):
        for value in test.values:
            yield from _truths(value)
    elif isinstance(test, ast.UnaryOp):
        yield from _truths(test.operand)
    elif isinstance(test, ast.Name):
        yield test.id
    elif isinstance(test, ast.Attribute):
        yield test.attr


COUNTS: dict[str, Callable[[House], float]] = {
    "lines without dynamics/": lambda house: house.lines,
    "modules": lambda house: len(house.modules),
    "share of import lines [%]": lambda house: house.imports,
    "short modules": lambda house: len(house.short),
    "class names that stand more than once": lambda house: len(house.ambiguous),
    'docstrings that begin with "What"': lambda house: len(house.what),
    "vague names": lambda house: len(house.vague),
    "branches on the kind of robot": lambda house: len(house.branches),
    "look-ups below a run": lambda house: len(house.lookups),
}
"""The counts by what they count."""


def table(house: House) -> str:
    """The counts as a Markdown table."""
    rows = [f"| {name} | {count(house):,} |" for name, count in COUNTS.items()]
    return "\n".join(["| of `biped/` | now |", "|---|---:|", *rows])


if __name__ == "__main__":
    print(table(House()))
