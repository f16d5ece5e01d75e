"""docs/commands.md from the parsers of the command line: `python -m biped.cli.reference` writes it."""

import argparse

from biped.base.errors import markdown_table
from biped.cli.common import commands_of
from biped.cli.main import build
from biped.show.document import DOCS

PAGE = DOCS / "commands.md"

_HEAD = """# Commands

You want to know what a command takes. This page lists every command with every option. It is written from the
parsers by `python -m biped.cli.reference`, so it agrees with `--help`.

`--json` prints one object and nothing else. Every command ends with one of these exit codes:

| exit code | meaning |
|---|---|
| 0 | The command is done, and all expectations are met. |
| 1 | A run or a check failed. |
| 2 | Something in the input cannot be used. The error names file, key, expectation and nearest valid name. |
| 3 | There were too few runs to decide a check. |

"""


def page() -> str:
    """The text of docs/commands.md."""
    parser = build()
    helps = {action.dest: action.help for action in _choices(parser)}
    parts = [_section(name, helps[name] or "", one) for name, one in commands_of(parser).items()]
    rows = ((f"[`biped {name}`](#biped-{name})", _cell(helps[name] or "")) for name in commands_of(parser))
    return "\n\n".join([_HEAD + markdown_table(("command", "what it does"), rows), *parts]) + "\n"


def _choices(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """One pseudo action for each command, which holds its line of help."""
    (commands,) = (one for one in parser._actions if isinstance(one, argparse._SubParsersAction))
    return list(commands._choices_actions)


def _section(name: str, line: str, parser: argparse.ArgumentParser) -> str:
    """A command with its arguments."""
    description = parser.description or line
    head = f"## biped {name}\n{description[:1].upper()}{description[1:].rstrip('.')}.\n\n"
    rows = [
        (f"`{_cell(_words(action))}`", _cell(action.help or ""))
        for action in parser._actions
        if not isinstance(action, argparse._HelpAction) and action.help is not argparse.SUPPRESS
    ]
    return head + (markdown_table(("argument", "meaning"), rows) if rows else "It takes no arguments.")


def _words(action: argparse.Action) -> str:
    """An argument as it is typed."""
    value = action.metavar or (action.dest if not action.option_strings else action.dest.upper())
    if action.choices is not None:
        value = ", ".join(map(str, action.choices))
    if not action.option_strings:
        return str(value)
    return action.option_strings[-1] + ("" if action.nargs == 0 else f" {value}")


def _cell(text: str) -> str:
    """Words for a cell of a table."""
    return " ".join(text.replace("|", "\\|").replace("%%", "%").split())


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
