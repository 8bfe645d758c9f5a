"""The command reference: what `--help` prints, a page for every command, made while the site is built."""

import sys
from pathlib import Path

import click
from mkdocs.structure.files import File

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from factorlab.cli import main

WIDTH = 96


def on_config(config):
    """Put the pages into the navigation."""
    config.nav.append({"Commands": ["commands/index.md", *({name: place(name)} for name in main.commands)]})
    return config


def on_files(files, config):
    """Write the pages."""
    for name, command in main.commands.items():
        files.append(File.generated(config, place(name), content="\n".join(page(command, name))))
    files.append(File.generated(config, "commands/index.md", content=overview()))
    return files


def place(name):
    """Where the page of a command lies."""
    return f"commands/{name}.md"


def page(command, name, level=1):
    """The help of a command, then that of its subcommands."""
    context = command.context_class(
        command, info_name=f"factorlab {name}", max_content_width=WIDTH, terminal_width=WIDTH
    )
    lines = [f"{'#' * level} factorlab {name}", "", "```text", command.get_help(context), "```", ""]
    if isinstance(command, click.Group):  # some import a command only when it is asked for
        for inner in command.list_commands(context):
            lines += page(command.get_command(context, inner), f"{name} {inner}", level=2)
    return lines


def overview():
    """The first page: every command with its first sentence."""
    lines = ["# Commands", "", "What `factorlab --help` and `factorlab COMMAND --help` print.", ""]
    lines += ["| command | what it does |", "|---|---|"]
    for name, command in main.commands.items():
        lines.append(f"| [factorlab {name}]({name}.md) | {command.get_short_help_str(120)} |")
    return "\n".join(lines)
