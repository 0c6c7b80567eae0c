"""The page of the commands, made from the commands."""

from __future__ import annotations

import re

import click

from trainmj.cli import main

_INTRODUCTION = """# Commands

This page is made from the commands themselves; `trainmj COMMAND --help` shows the same. Wrong input ends with one
message and exit code 2, never with a traceback.
"""


def page() -> str:
    """All commands, each with its arguments and options."""
    parts = [_INTRODUCTION, _text(main.help or "")]
    parts += [_command(name, command) for name, command in main.commands.items()]
    return "\n\n".join(parts) + "\n"


def _command(name: str, command: click.Command) -> str:
    context = click.Context(command, info_name=f"trainmj {name}")
    usage = f"```text\ntrainmj {name} {' '.join(command.collect_usage_pieces(context))}\n```"
    rows = [_option(o, context) for o in command.params if isinstance(o, click.Option)]
    table = "\n".join(["| option | default | |", "|---|---|---|", *rows])
    return "\n\n".join([f"## {name}", usage, _text(command.help or ""), table if rows else "No options."])


def _option(option: click.Option, context: click.Context) -> str:
    names = ", ".join(f"`{n}`" for n in (*option.opts, *option.secondary_opts))
    if not option.is_flag:
        names += f" `{option.make_metavar(context)}`"
    return f"| {names} | {_default(option)} | {_escaped(option.help or '')} |"


def _default(option: click.Option) -> str:
    if option.required:
        return "required"
    if option.secondary_opts:  # a pair such as --smooth/--fast
        return f"`{(option.opts if option.default else option.secondary_opts)[0]}`"
    if option.is_flag or option.multiple or option.default is None or str(option.default).startswith("Sentinel"):
        return ""
    return f"`{option.default}`"


def _text(help_: str) -> str:
    """Help as Markdown; what is code there (in capitals, or with dashes) is left as it is."""
    return re.sub(r"(?<![`\w-])(--[a-z][a-z-]*)(?!`)", r"`\1`", _dedented(help_))


def _dedented(text: str) -> str:
    first, *rest = text.splitlines()
    return "\n".join([first.strip(), *(line.strip() for line in rest)]).replace("\b", "")


def _escaped(text: str) -> str:
    return text.replace("|", "\\|").replace("*", "\\*")
