"""The ``panoscene`` command: one typed function for each subcommand."""

# first: what is registered first is called last at the end
import panoscene.cli._ending  # noqa: F401
from panoscene.cli._program import COMMANDS as COMMANDS
from panoscene.cli._program import main as main
from panoscene.cli._program import run as run
