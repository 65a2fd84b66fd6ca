"""The ``panoscene`` command: one typed function for each subcommand."""

from panoscene.cli._program import COMMANDS as COMMANDS
from panoscene.cli._program import main as main
