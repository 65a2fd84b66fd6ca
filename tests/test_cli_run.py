"""The program's process: how it ends."""

import subprocess
import sys
from pathlib import Path

import pytest

BEFORE = "import atexit, sys; from panoscene.cli import _program; "


def ended(code: str, *arguments: str) -> tuple[int, str, str]:
    """Run the program in a process of its own; gives exit code, stdout and stderr."""
    command = [sys.executable, "-c", code, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize(
    ("arguments", "code"), [(["--version"], 0), (["--help"], 0), (["draw"], 2), (["fly"], 2)]
)
def test_the_process_ends_with_the_exit_code(arguments: list[str], code: int) -> None:
    found, out, err = ended(f"{BEFORE}_program.run()", *arguments)
    assert found == code
    assert bool(out) == (code == 0)
    assert bool(err) == (code != 0)


def test_what_is_registered_is_done_before() -> None:
    code = f"{BEFORE}_program.main = lambda: atexit.register(print, 'done') and 3; _program.run()"
    assert ended(code) == (3, "done\n", "")


def test_files_of_libraries_are_tidied_up() -> None:
    make = "multiprocessing.util.get_temp_dir()"
    code = f"{BEFORE}import multiprocessing.util; _program.main = lambda: print({make}) or 0"
    found, out, _ = ended(f"{code}; _program.run()")
    assert found == 0
    assert out.strip()
    assert not Path(out.strip()).exists()


def test_an_error_of_the_program_is_shown() -> None:
    code, _, err = ended(f"{BEFORE}_program.main = lambda: 1 // 0; _program.run()")
    assert code == 1
    assert "ZeroDivisionError" in err


def test_an_interrupt_while_it_starts_is_quiet(tmp_path: Path) -> None:
    # as Ctrl-C in the first tenths of a second, while the option parser is imported
    (tmp_path / "tyro.py").write_text("raise KeyboardInterrupt")
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from panoscene.cli import run; run()"
    )
    assert ended(code, "--version") == (130, "", "")


def test_closed_streams_do_not_matter() -> None:
    code = "import sys; sys.stdout = sys.stderr = None; from panoscene.cli import run; run()"
    assert ended(code, "--version") == (0, "", "")
    assert ended(code, "draw") == (2, "", "")
