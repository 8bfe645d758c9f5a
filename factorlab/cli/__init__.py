"""The command line: one file a command, heavy libraries imported when a command runs.

Exit codes: 0 ok, 1 the data are at fault, 2 the command line is, 3 (only with --check) a consistency check failed.
"""

import click

from factorlab.cli.compare import compare
from factorlab.cli.demo import demo
from factorlab.cli.doctor import doctor
from factorlab.cli.info import info

__all__ = ["main"]


@click.group(name="factorlab", context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="factorlab")
def main() -> None:
    """From a raw sensor log to a tuned, consistency-checked estimate.

    Start with `factorlab demo`; then give `factorlab compare` a dataset or a log of your own.
    """


for command in (demo, compare, info, doctor):
    main.add_command(command)
