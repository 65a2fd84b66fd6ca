"""The ``panoscene`` command: one typed function for each subcommand."""

# first: what is registered first is called last at the end
import panoscene.cli._ending  # noqa: F401

try:
    from panoscene.cli._program import COMMANDS as COMMANDS
    from panoscene.cli._program import main as main
    from panoscene.cli._program import run as run
except KeyboardInterrupt:
    # Ctrl-C so early ends with the exit code that it has later
    raise SystemExit(130) from None
