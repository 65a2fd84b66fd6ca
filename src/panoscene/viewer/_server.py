"""Starting and stopping the live editor."""

import errno
import logging
import os
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

import rich
import viser
from jaxtyping import Float
from torch import Tensor

from panoscene.scene import Scene, read_panorama, read_scene, relocate_photo, upright_photo
from panoscene.style import INK

from ._app import ViewerApp
from ._drawing import rgb


class ViewerHandle:
    """A running editor; as a context manager it stops at the end of the block."""

    def __init__(self, server: viser.ViserServer, app: ViewerApp) -> None:
        self._server = server
        self._ended = threading.Event()
        self.app = app
        host, self.port = server.get_host(), server.get_port()
        shown = {"0.0.0.0": "localhost", "::": "localhost"}.get(host, host)  # noqa: S104
        self.url = (
            f"http://[{shown}]:{self.port}" if ":" in shown else f"http://{shown}:{self.port}"
        )

    @property
    def scene(self) -> Scene:
        """The scene as it stands, with the wanted relations."""
        return self.app.editor.scene

    def wait(self) -> None:
        """Wait until the editor is stopped; Ctrl-C raises KeyboardInterrupt as usual."""
        self._ended.wait()

    def stop(self) -> None:
        """Disconnect everybody and free the port; a second time does nothing."""
        if not self._ended.is_set():
            self.app.stop()
            with _silent():
                self._server.stop()
            self._ended.set()

    def __enter__(self) -> "ViewerHandle":
        """Return the running editor."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop the editor."""
        self.stop()


def serve(
    scene: Scene,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    image: Float[Tensor, "3 height width"] | None = None,
    save_to: Path | None = None,
) -> ViewerHandle:
    """Return the running editor of a scene; its ``url`` is to be opened in a browser.

    It runs in threads of its own. Everything it shows comes from this machine: the page loads
    nothing from the network, and nobody is let in from it unless ``host`` says so.

    Args:
        scene: what to edit; it stays as it is.
        host: address to listen on; 127.0.0.1 lets in only this machine, 0.0.0.0 everybody.
        port: 0 takes any free one.
        image: the panorama, RGB in [0, 1], for the view from the camera.
        save_to: file that the button Save writes; without it there is only Download.

    Raises:
        ValueError: host or port cannot be listened on, or relations are missing and cannot be
            derived.
    """
    _check_address(host, port)
    # port scanners, and browsers that open connections in advance: no reason for a traceback
    logging.getLogger("websockets.server").addFilter(_STRANGERS)
    with _silent():
        server = _LocalServer(host=host, port=port, label="panoscene", verbose=False)
    if port not in (0, server.get_port()):
        with _silent():
            server.stop()
        raise _taken(host, port)
    try:
        red, green, blue = rgb(INK)
        server.gui.configure_theme(
            show_logo=False,
            show_share_button=False,
            brand_color=(red, green, blue),
        )
        server.gui.main_panel.dock_right()
        return ViewerHandle(server, ViewerApp(server, scene, image, save_to))
    except BaseException:
        with _silent():
            server.stop()
        raise


def view_file(
    path: str | os.PathLike[str],
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    photo: str | os.PathLike[str] | None = None,
    save_to: str | os.PathLike[str] | None = None,
) -> ViewerHandle:
    """Return the running editor of a scene file.

    Args:
        path: a scene.json file.
        host: address to listen on.
        port: 0 takes any free one.
        photo: the panorama; without it the one the scene names, if that is there. A tilted one is
            turned upright, as the scene says.
        save_to: file that the button Save writes; without it there is only Download.

    Raises:
        SceneFormatError: the file is not a scene.
        PanoramaError: the picture is not a panorama.
        ValueError: as for ``serve``.
    """
    path = Path(path)
    scene = read_scene(path)
    named = scene.panorama.file
    if photo is None and named is not None and (path.parent / named).is_file():
        photo = path.parent / named
    image = None if photo is None else upright_photo(read_panorama(photo)[0], scene.panorama)
    target = None if save_to is None else Path(save_to)
    if target is not None:
        scene = relocate_photo(scene, path, target)
    return serve(scene, host=host, port=port, image=image, save_to=target)


class _StrangersFilter(logging.Filter):
    """Drops what the server says of those who connect and do not speak its language."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether a message is worth a line on the terminal."""
        return record.getMessage() != "opening handshake failed"


_STRANGERS = _StrangersFilter()


class _LocalServer(viser.ViserServer):
    """A server that no browser can ask to publish itself."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Return no address: what is edited here stays here."""
        return None


def _check_address(host: str, port: int) -> None:
    """Refuse what cannot be listened on; viser itself would take another port."""
    if not 0 <= port <= 65535:
        raise ValueError(f"port: found {port}, expected 0 to 65535")
    try:
        family, kind, _, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
    except (socket.gaierror, UnicodeError):
        raise ValueError(f"host: found {host!r}, expected an address of this machine") from None
    with socket.socket(family, kind) as probe:
        if os.name == "posix":
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(address)
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                raise _taken(host, port) from None
            if error.errno == errno.EADDRNOTAVAIL:
                expected = "an address of this machine"
                raise ValueError(f"host: found {host!r}, expected {expected}") from None
            reason = (error.strerror or str(error)).lower()
            raise ValueError(f"port: found {port} on {host}: {reason}") from None


def _taken(host: str, port: int) -> ValueError:
    return ValueError(
        f"port: found {port} on {host} in use, expected a free one; 0 takes any that is free"
    )


@contextmanager
def _silent() -> Iterator[None]:
    """Keep viser from printing to the terminal, which belongs to the program."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
