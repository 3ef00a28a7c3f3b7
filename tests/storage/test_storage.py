"""Results on object storage, by Snakemake's plugin, against a server of S3 on this machine."""

import re
import sys

import pytest
import xarray as xr

from conftest import served
from springtune.studies.runs import checked_json

pytestmark = pytest.mark.slow

STUDY = """
title: A few scenes
beams: {small: {length: 50 mm, height: 10 mm}}
materials: {steel: {young_modulus: 210 GPa, poisson_ratio: 0.3}}
outputs: [tables]
grids:
  pulled:
    {beam: small, mesh_type: structured, mesh_size: [5 mm, 2.5 mm], material: steel, load: traction, force: 1 kN,
     definition: [uniform, lattice]}
"""
PLACE = "storage=s3://results/mine"
PACKS = {"/results/mine/tiny/" + name for name in ("reference.tar", "mesh.tar", "sensitivity.tar", "solve.tar")}


def write(machine, text=STUDY):
    (machine.folder / "config/tiny.yaml").write_text(text)
    return machine


def computed(machine):
    """Tasks that the last jobs of a machine's stages computed, by kind."""
    found = {}
    for path in machine.folder.glob("results/tiny/done/*_*.json"):
        for kind, (count, *_) in (checked_json.read(path).get("work") or {}).items():
            found[kind] = found.get(kind, 0) + count
    return found


def groups(machine):
    path = machine.folder / "results/tiny/dataset.nc"
    with xr.open_datatree(path, engine="netcdf4", decode_cf=False) as tree:
        found = {node.path: node.to_dataset(inherit=False).load() for node in tree.subtree}
    return {path: group.drop_vars([name for name in group if "seconds" in name]) for path, group in found.items()}


def test_another_machine_starts_from_the_storage_and_computes_what_is_missing(machine, storage):
    first = write(machine("first"))
    code, output = first.snakemake("publish", "--config", PLACE)
    assert code == 0, output
    assert {*storage.objects} >= PACKS | {"/results/mine/tiny/dataset.nc", "/results/mine/tiny/index.html"}
    published = len(storage.requests)

    code, output = first.snakemake("publish", "--config", PLACE)
    assert code == 0 and "Nothing to be done" in output, output
    again = len(storage.requests) - published

    second = write(machine("second"))
    code, output = second.snakemake("fetch", "--config", PLACE)
    assert code == 0 and "4 packs" in output and "all that it asks for is here" in output, output
    fetched = len(storage.requests) - published - again
    print(f"requests: {published} to publish, {again} to see that all is there, {fetched} to fetch")

    code, output = second.snakemake()
    assert code == 0, output
    assert computed(second) == {}
    for path, group in groups(first).items():
        xr.testing.assert_equal(group, groups(second)[path])

    # What the study asks for besides is computed, and nothing else; then it is there for the first machine.
    write(second, STUDY.replace("lattice]", "lattice, area]"))
    code, output = second.springtune("publish", "--config", PLACE)
    assert code == 0, output
    assert computed(second) == {"nonlinear": 2, "area": 2}
    write(first, STUDY.replace("lattice]", "lattice, area]"))
    code, output = first.snakemake("fetch", "--config", PLACE)
    assert code == 0, output
    code, output = first.snakemake()
    # Snakemake's own notes are of the study before, so it runs `solve`, which finds all stored and computes nothing.
    ran = {*re.findall(r"\(Rule: (\w+)\)", output)}
    assert code == 0 and ran == {"solve", "collect", "present_scenes", "browse", "all"}, output
    assert not {"nonlinear", "area"} & computed(first).keys()


def test_what_is_half_uploaded_is_not_taken_for_whole(machine, storage):
    first = write(machine("first"))
    code, output = first.snakemake()
    assert code == 0, output
    # The server is gone after two objects.
    storage.most = 2
    code, output = first.snakemake("publish", "--config", PLACE, "--storage-s3-retries", "0")
    assert code == 1, output
    storage.most = None
    second = write(machine("second"))
    code, output = second.snakemake("fetch", "--config", PLACE)
    packs = len(PACKS & {*storage.objects})
    if packs:
        assert code == 0 and re.search(rf"{packs} packs, .* jobs are left", output), output
    else:
        assert code == 1 and "holds no results of this study" in output, output
    # The same command goes on where it was.
    code, output = first.snakemake("publish", "--config", PLACE)
    assert code == 0, output
    assert {*storage.objects} >= PACKS

    # Half of a pack, as no storage should have it.
    whole = storage.ask("GET", "/results/mine/tiny/solve.tar")
    storage.ask("PUT", "/results/mine/tiny/solve.tar", whole[: len(whole) // 2])
    third = write(machine("third"))
    code, output = third.snakemake("fetch", "--config", PLACE)
    assert code == 1 and "solve.tar: is not whole" in output and "publish it again" in output, output
    assert not [*third.folder.glob("results/tiny/**/*.h5")]


def test_what_is_wrong_is_told(machine, environment):
    one = write(machine("one"))
    code, output = one.snakemake("fetch", "--config", "storage=s3://no-such-bucket/mine")
    assert code == 1 and "s3://no-such-bucket/mine/tiny holds no results of this study" in output, output
    code, output = one.snakemake("fetch", "--config", "storage=results/mine")
    assert code == 1 and "'results/mine' is no place for results; give one such as s3://bucket/folder" in output
    nowhere = {"SNAKEMAKE_STORAGE_S3_ENDPOINT_URL": "http://127.0.0.1:9"}
    code, output = one.snakemake("fetch", "--config", PLACE, "--storage-s3-retries", "0", **nowhere)
    assert code == 1 and "Could not connect to the endpoint" in output and "see whether the storage is there" in output
    code, output = one.snakemake("fetch")
    assert code == 1 and "where? give --config storage=s3://bucket/folder" in output, output
    with served(environment, INITIAL_NO_AUTH_ACTION_COUNT="0") as port:
        strict = {"SNAKEMAKE_STORAGE_S3_ENDPOINT_URL": f"http://127.0.0.1:{port}"}
        code, output = one.snakemake("fetch", "--config", PLACE, **strict)
        assert code == 1 and "403" in output and "correct access key, secret key" in output, output
    assert "Traceback" not in output


def test_the_plugin_that_is_missing_is_named(machine):
    code, output = write(machine("one", sys.executable)).snakemake("publish", "--config", PLACE)
    assert code == 1 and "is not installed; install the extra, in a clone `pip install '.[s3]'`" in output, output
