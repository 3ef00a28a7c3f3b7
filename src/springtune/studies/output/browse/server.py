"""Serve the page of one dataset to this machine alone."""

import errno
import mimetypes
import os
import secrets
import sys
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from ..reading import dataset_file
from .page import page

HOST = "127.0.0.1"

SERVED = {"figures": (".pdf", ".png"), "tables": (".csv", ".html", ".md")}
"""Served folders beside a dataset, with the endings of served files."""

ALONE = ("paper.pdf", "report.zip")
"""Served files beside a dataset."""

POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src 'self' data: blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""The page may load nothing but pictures of this server."""


class Server(ThreadingHTTPServer):
    """Server of a page, its dataset, and the figures and tables beside it.

    It listens on the loopback address and refuses requests by another host name, so that no foreign site can rename
    this address to its own. Every path begins with a new random token.
    """

    daemon_threads = True

    def __init__(self, dataset: str | os.PathLike[str], port: int = 0) -> None:
        path = dataset_file(dataset)
        self.served = _served(path)
        self.text = page(
            path, [name for name in self.served if name in ALONE or not name.endswith((".csv", ".nc", ".pdf"))]
        ).encode()
        self.token = secrets.token_urlsafe(24)
        try:
            super().__init__((HOST, port), Handler)
        except OSError as error:
            if error.errno not in (errno.EADDRINUSE, errno.EACCES):
                raise
            why = "is in use" if error.errno == errno.EADDRINUSE else "is not for everybody"
            raise OSError(f"--port: {port} {why}; give another one, or none for one that is free") from None
        self.hosts = {f"{name}:{self.server_port}" for name in (HOST, "localhost")}
        self.address = f"http://{HOST}:{self.server_port}/{self.token}/"

    def server_bind(self) -> None:
        """Bind without looking up the host name, which may need a network."""
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()
        self.server_name, self.server_port = HOST, int(self.server_address[1])

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore browsers that close the connection in the middle of a file."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class Handler(BaseHTTPRequestHandler):
    """Answer requests."""

    server: Server
    server_version, sys_version = "springtune", ""

    def do_GET(self) -> None:
        """Send the page, or one of the files that are served."""
        if self.headers.get("Host") not in self.server.hosts:
            self._refuse(HTTPStatus.MISDIRECTED_REQUEST)
            return
        token, slash, name = unquote(urlsplit(self.path).path).removeprefix("/").partition("/")
        if not slash or not secrets.compare_digest(token.encode(), self.server.token.encode()):
            self._refuse(HTTPStatus.NOT_FOUND)
        elif name in ("", "index.html"):
            self._send(self.server.text, "text/html; charset=utf-8")
        elif name in self.server.served:  # known names alone: no path is built from a request
            try:
                content = self.server.served[name].read_bytes()
            except OSError:
                self._refuse(HTTPStatus.NOT_FOUND)
                return
            kind = mimetypes.guess_type(name)[0] or "application/octet-stream"
            self._send(content, f"{kind}; charset=utf-8" if kind.startswith("text/") else kind)
        else:
            self._refuse(HTTPStatus.NOT_FOUND)

    def _send(self, content: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK) -> None:
        self.send_response(status)
        for name, value in {
            "Content-Type": kind,
            "Content-Length": str(len(content)),
            "Cache-Control": "no-store",
            "Content-Security-Policy": POLICY,
            "Cross-Origin-Resource-Policy": "same-origin",
            "Referrer-Policy": "no-referrer",
            "X-Content-Type-Options": "nosniff",
        }.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def _refuse(self, status: HTTPStatus) -> None:
        self._send(f"{status.value} {status.phrase}\n".encode(), "text/plain; charset=utf-8", status)

    def log_message(self, format: str, *args: object) -> None:
        """Log nothing: the address holds the token."""


def _served(dataset: Path) -> dict[str, Path]:
    """Served files by name."""
    found = {"dataset.nc": dataset}
    for folder, endings in SERVED.items():
        for path in sorted((dataset.parent / folder).glob("*")):
            if path.suffix in endings and _is_own(path):
                found[f"{folder}/{path.name}"] = path
    return found | {name: dataset.parent / name for name in ALONE if _is_own(dataset.parent / name)}


def _is_own(path: Path) -> bool:
    """Return whether a path is a file and no link."""
    return path.is_file() and not path.is_symlink()
