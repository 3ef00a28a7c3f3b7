"""The page to browse: its bytes, and the server of one; `tests/browser` looks at it in a browser."""

import base64
import http.client
import json
import re
import socket
import subprocess
import sys
import threading
import zlib

import h5netcdf
import h5py
import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from springtune.studies.output.browse.server import Server

import springtune
from springtune.cli import main
from springtune.studies.output.browse.page import packed, page

from synthetic import dataset

TITLE = "<script>alert('&')</script>"


def write(folder, *groups):
    """Write the dataset of a study, and a group that nobody knows."""
    tree = dataset(*groups)
    tree["weather"] = xr.DataTree(xr.Dataset({"rain": (("town", "day"), [[1.0, 2.0]])}, {"town": ["here"]}))
    tree.attrs = {"springtune_version": springtune.__version__, "study": "mine", "title": TITLE, "note": float("nan")}
    tree.to_netcdf(folder / "dataset.nc", engine="h5netcdf")
    return folder / "dataset.nc"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A dataset of two groups, and what was made of it."""
    folder = tmp_path_factory.mktemp("mine")
    for name in ("figures/one.png", "figures/one.txt", "tables/index.html", "secret.txt"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(name)
    (folder / "figures/link.png").symlink_to(folder / "secret.txt")
    return write(folder, "fields", "moduli")


def content(text):
    """What a page says of its dataset."""
    block = re.search(r'id="content">([^<]*)<', text)[1]
    return json.loads(zlib.decompress(base64.b64decode(block)))


@pytest.fixture(scope="module")
def text(path):
    return page(path)


class TestPage:
    def test_same_dataset_same_bytes(self, path, text):
        assert page(path) == text

    def test_texts_of_the_dataset_are_no_markup(self, path):
        text = page(path, ["figures/<img src=x>.png"])
        assert "alert('" not in text and "<img src=x>" not in text
        assert "<title>&lt;script&gt;alert(&#39;&amp;&#39;)&lt;/script&gt;</title>" in text

    def test_policy_names_every_script_and_forbids_to_load(self, text):
        policy = re.search(r'Policy" content="([^"]*)"', text)[1].replace("&#39;", "'")
        assert policy.startswith("default-src 'none'; script-src 'sha256-")
        assert "unsafe-inline" not in policy.partition("script-src")[2].partition(";")[0]
        assert not re.search(r"(src|href)=\"?(https?:)?//", text)

    def test_every_group_and_variable_is_in_it(self, tmp_path):
        path = write(tmp_path)
        groups = {group["path"]: group for group in content(page(path))["groups"]}
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            for node in tree.subtree:
                held = {row["name"] for row in groups[node.path]["variables"]}
                assert held == set(map(str, node.to_dataset(inherit=False).data_vars))
        assert groups["/weather"]["dims"][0] == {"name": "town", "size": 1, "labels": ["here"]}
        assert "labels" not in groups["/weather"]["dims"][1]  # a dimension without labels

    def test_texts_of_one_letter_may_be_bytes(self, path, tmp_path):
        """So does netCDF's own library write them, such as the units of a length."""
        copy = tmp_path / "copy.nc"
        copy.write_bytes(path.read_bytes())
        with h5py.File(copy, "r+") as file:
            file["fields/x"].attrs["units"] = np.bytes_("m")
        fields = next(group for group in content(page(copy))["groups"] if group["path"] == "/fields")
        assert next(row for row in fields["variables"] if row["name"] == "x")["units"] == "m"

    def test_what_is_too_large_is_named(self, path):
        with h5netcdf.File(path) as file:
            whole, contents = packed(file)
            room = sum(map(len, contents)) // 2
            some, contents = packed(file, room)
        assert 0 < sum(map(len, contents)) <= 1.1 * room
        for group, less in zip(whole, some):
            names = [[row["name"] for row in one["variables"]] for one in (group, less)]
            assert sorted(names[0]) == sorted(names[1] + less["left_out"]) and not group["left_out"]

    def test_links_are_those_given(self, path):
        assert content(page(path, ["tables/index.html", "figures/b.png"]))["files"] == [
            "figures/b.png",
            "tables/index.html",
        ]

    def test_views_name_variables_that_studies_have(self):
        """A plot whose variable is misspelt would be left out silently."""
        from springtune.studies.kinds.benchmark.kind import KIND as BENCHMARK
        from springtune.studies.kinds.collect import group_of
        from springtune.studies.kinds.engines.collect import ENGINE_CURVES, ENGINE_RUNS
        from springtune.studies.kinds.laying.collect import LAYING
        from springtune.studies.kinds.moduli.kind import KIND as MODULI
        from springtune.studies.kinds.samples.collect import EFFECTS, SAMPLES, SOBOL
        from springtune.studies.kinds.samples.designs import PARAMETERS
        from springtune.studies.kinds.scenes.variables import BLOCK, FIELDS, FINITE_STRAIN, ROOT, SENSITIVITY
        from springtune.studies.kinds.shapes.collect import AT_FINITE_STRAIN, SHAPE_FIELDS, SHAPES
        from springtune.studies.kinds.stability.collect import STABILITY
        from springtune.studies.output.browse.page import views

        groups = (ROOT, SENSITIVITY, FINITE_STRAIN, BLOCK, FIELDS, LAYING, STABILITY, ENGINE_RUNS, ENGINE_CURVES)
        groups += tuple(map(group_of, (MODULI, BENCHMARK)))
        groups += (SAMPLES, EFFECTS, SOBOL, SHAPES, SHAPE_FIELDS, AT_FINITE_STRAIN)
        coordinates = {"/samples": {*PARAMETERS, "sample_mesh_size"}}
        known = {group.name: group for group in groups}
        for view in views().values():
            variables = known[view.group].variables
            dimensions = {name for row in variables.values() for name in row[0]} | coordinates.get(view.group, set())
            assert set(view.columns) <= set(variables)
            for plot in view.plots:
                beside = {name for row in plot.beside for name in row[:2]}
                assert {plot.value, plot.x, *beside} <= set(variables) | dimensions, plot.title
                assert {plot.by, plot.along} - {""} <= dimensions, plot.title
                assert set(plot.selection) <= dimensions, plot.title

    def test_imports_nothing_heavy(self):
        code = (
            "import sys, springtune.studies.output.browse.page\n"
            "print(sorted({'xarray', 'matplotlib', 'scipy', 'bokeh', 'pydantic', 'snakemake'} & set(sys.modules)))"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert done.stdout == "[]\n", done.stderr


@pytest.fixture(scope="module")
def server(path):
    with Server(path) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def ask(server, path, host=None, method="GET"):
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=60)
    try:
        connection.request(method, path, headers={"Host": host or f"127.0.0.1:{server.server_port}"})
        answer = connection.getresponse()
        return answer.status, answer.read(), answer.headers
    finally:
        connection.close()


class TestServer:
    def test_sends_the_page_its_dataset_and_what_was_made_of_it(self, server, path):
        for name, found in (("", server.text), ("index.html", server.text), ("dataset.nc", path.read_bytes())):
            status, body, headers = ask(server, f"/{server.token}/{name}")
            assert (status, body) == (200, found)
            assert headers["Cache-Control"] == "no-store" and headers["X-Content-Type-Options"] == "nosniff"
            assert headers["Content-Security-Policy"].startswith("default-src 'none'")
        status, body, headers = ask(server, f"/{server.token}/figures/one.png")
        assert (status, body, headers["Content-Type"]) == (200, b"figures/one.png", "image/png")
        assert ask(server, f"/{server.token}/tables/index.html")[1] == b"tables/index.html"

    @pytest.mark.parametrize("name", [
        "secret.txt", "figures/one.txt", "figures/link.png", "figures/", "../secret.txt", "figures/../secret.txt",
        "figures/..%2fsecret.txt", "%2e%2e/secret.txt", "/etc/passwd", "figures/one.png/..", "tables/index.html%00",
    ])  # fmt: skip
    def test_sends_nothing_else(self, server, name):
        assert ask(server, f"/{server.token}/{name}")[0] == 404

    def test_needs_its_token(self, server):
        for token in ("", "x", server.token[:-1], server.token + "x", "%ff"):
            assert ask(server, f"/{token}/dataset.nc")[0] == 404
        assert ask(server, "/")[0] == 404 and ask(server, "/dataset.nc")[0] == 404

    def test_answers_to_no_other_name(self, server):
        """A page of somebody else that has its own name point to this machine must not read it."""
        for host in ("evil.example", f"evil.example:{server.server_port}", "127.0.0.1", "127.0.0.1:1"):
            assert ask(server, f"/{server.token}/", host)[0] == 421
        assert ask(server, f"/{server.token}/", f"localhost:{server.server_port}")[0] == 200

    def test_only_gives(self, server):
        for method in ("POST", "PUT", "DELETE", "HEAD", "OPTIONS"):
            assert ask(server, f"/{server.token}/", method=method)[0] == 501

    def test_listens_on_the_loopback_address_alone(self, server):
        assert server.socket.getsockname()[0] == "127.0.0.1"

    def test_a_token_is_drawn_each_time(self, server, path):
        with Server(path) as other:
            assert other.token != server.token and len(other.token) >= 32


class TestCommand:
    def refused(self, *arguments):
        result = CliRunner().invoke(main, ["browse", *map(str, arguments)])
        assert result.exit_code == 1 and len(result.stderr.splitlines()) == 1 and result.stdout == ""
        return result.stderr

    def test_refusals_are_one_line(self, tmp_path):
        assert "none.nc: there is no such dataset; run the study" in self.refused(tmp_path / "none.nc")
        assert "there is no such dataset" in self.refused(tmp_path)
        (tmp_path / "text.nc").write_text("no dataset")
        assert "text.nc: cannot be read" in self.refused(tmp_path / "text.nc")
        xr.Dataset({"x": 1}).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
        assert "other.nc: is not a dataset of springtune" in self.refused(tmp_path / "other.nc")

    def test_a_port_in_use_is_named(self, path):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            port = taken.getsockname()[1]
            assert f"--port: {port} is in use; give another one" in self.refused(path, "--port", port)

    def test_ctrl_c_ends_it_quietly(self, path):
        import signal

        command = [sys.executable, "-m", "springtune", "browse", str(path.parent), "--no-open"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            address = process.stdout.readline().strip()
            assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{32}/", address)
            process.send_signal(signal.SIGINT)
            out, err = process.communicate()
        assert process.returncode == 0 and err == "", err
