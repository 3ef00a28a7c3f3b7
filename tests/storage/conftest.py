"""A server of S3 on this machine, what stands between it and a run, and a Python with Snakemake's plugin for it."""

import http.client
import os
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
HOST = "127.0.0.1"
SIGNED = {"Authorization": "AWS4-HMAC-SHA256 Credential=testing/20200101/us-east-1/s3/aws4_request"}
"""What the server asks for before it gives an object: that somebody signed, whoever it is."""

PASSED_ON = {"connection", "transfer-encoding", "content-length", "date", "server"}
"""Headers of an answer that are said anew."""


@pytest.fixture(scope="session")
def environment(tmp_path_factory):
    """Folder of the programs of an environment of its own."""
    folder = tmp_path_factory.mktemp("storage") / "venv"
    lock = REPOSITORY / "requirements/storage.txt"
    install = ["pip", "install", "--python", folder, "--require-hashes", "--requirements", lock]
    for command in (["venv", "--python", sys.executable, folder], install):
        done = subprocess.run(["uv", *map(str, command)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    return folder / "bin"


def free_port():
    with socket.socket() as one:
        one.bind((HOST, 0))
        return one.getsockname()[1]


def _answers(port):
    try:
        socket.create_connection((HOST, port)).close()
    except OSError:
        return False
    return True


@contextmanager
def served(environment, **variables):
    """A server of S3, which ends with the context; its port."""
    port = free_port()
    command = [environment / "python", "-m", "moto.server", "-H", HOST, "-p", str(port)]
    process = subprocess.Popen(
        list(map(str, command)), env=os.environ | variables, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        while not _answers(port):
            assert process.poll() is None, "the server ended"
            time.sleep(0.1)
        yield port
    finally:
        process.kill()
        process.wait()


class Between:
    """What stands between a run and the server: counts requests, and is gone after some objects if it is told to."""

    def __init__(self, port):
        self.port, self.requests, self.objects, self.most = port, [], [], None
        between = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def log_message(self, *arguments):
                pass

            def handle_any(self):
                body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
                if between.most is not None and len(between.objects) >= between.most:
                    self.close_connection = True
                    self.connection.shutdown(socket.SHUT_RDWR)
                    return
                server = http.client.HTTPConnection(HOST, between.port)
                server.request(self.command, self.path, body, dict(self.headers))
                answer = server.getresponse()
                content = answer.read()
                between.requests.append(self.command)
                if self.command == "PUT" and self.path.count("/") > 1:
                    between.objects.append(self.path)
                self.send_response(answer.status)
                for name, value in answer.getheaders():
                    if name.lower() not in PASSED_ON:
                        self.send_header(name, value)
                length = answer.getheader("Content-Length", "0") if self.command == "HEAD" else str(len(content))
                self.send_header("Content-Length", length)
                self.end_headers()
                if self.command != "HEAD":
                    self.wfile.write(content)
                server.close()

            do_GET = do_PUT = do_HEAD = do_POST = do_DELETE = handle_any

        self.server = ThreadingHTTPServer((HOST, 0), Handler)
        self.thread = threading.Thread(target=self.server.serve_forever, daemon=True)
        self.thread.start()

    @property
    def address(self):
        """Where a run finds it."""
        return f"http://{HOST}:{self.server.server_address[1]}"

    def ask(self, how, path, content=None):
        """Ask the server itself; its answer."""
        server = http.client.HTTPConnection(HOST, self.port)
        server.request(how, path, content, SIGNED)
        answer = server.getresponse()
        found = answer.read()
        server.close()
        assert answer.status < 300, (how, path, answer.status, found)
        return found

    def close(self):
        self.server.shutdown()
        self.server.server_close()


@pytest.fixture
def storage(environment):
    """A server, and what stands before it."""
    with served(environment) as port:
        between = Between(port)
        try:
            yield between
        finally:
            between.close()


class Machine:
    """A folder to run studies in, with a Python that has the plugin or has not."""

    def __init__(self, folder, python, address):
        self.folder, self.python = folder, python
        folder.mkdir()
        (folder / "config").mkdir()
        named = {"ENDPOINT_URL": address, "REGION": "us-east-1", "ACCESS_KEY": "testing", "SECRET_KEY": "testing"}
        self.variables = {f"SNAKEMAKE_STORAGE_S3_{name}": value for name, value in named.items()}

    def snakemake(self, *arguments, **variables):
        """Exit code and output of a run."""
        command = [self.python, "-m", "snakemake", "--snakefile", REPOSITORY / "Snakefile", "--cores", "2"]
        command += ["--workflow-profile", REPOSITORY / "workflow/profiles/default", *arguments]
        command += ["--configfile", "config/tiny.yaml"]
        return self._called(command, variables)

    def springtune(self, *arguments, **variables):
        """Exit code and output of `springtune run`."""
        command = [self.python, "-m", "springtune", "run", "config/tiny.yaml", "--cores", "2", *arguments]
        return self._called(command, variables)

    def _called(self, command, variables):
        kept = {name: value for name, value in os.environ.items() if not name.lower().endswith("_proxy")}
        own = {"PYTHONPATH": str(REPOSITORY / "src"), "CI": "1"} | self.variables | variables
        done = subprocess.run(list(map(str, command)), cwd=self.folder, env=kept | own, capture_output=True, text=True)
        return done.returncode, done.stdout + done.stderr


@pytest.fixture
def machine(environment, storage, tmp_path):
    """Makes machines that know the storage."""
    return lambda name, python=environment / "python": Machine(tmp_path / name, python, storage.address)
