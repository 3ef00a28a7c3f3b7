"""A headless Chromium, and pages of datasets made for it."""

import json
import shutil

import numpy as np
import pytest
import xarray as xr
from selenium import webdriver
from selenium.common.exceptions import TimeoutException
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.support.ui import WebDriverWait

import springtune as st
from springtune.studies.kinds.bodies.collect import ROOT, SENSITIVITY
from springtune.studies.output.browse import page
from springtune.studies.output.dataset import STATUS

from synthetic import LABELS, dataset
from tables import beside

FLAGS = (
    "--headless=new --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-default-apps --disable-extensions --disable-sync"
)
PATIENCE = 120  # seconds until a page counts as stuck, on however busy a machine


def pytest_collection_modifyitems(items):
    for item in items:
        if "tests/browser" in item.path.as_posix():
            item.add_marker(pytest.mark.browser)


class Browser:
    """A window of Chromium, and what it heard and asked for since a page was opened."""

    def __init__(self, driver):
        self.driver = driver

    def resize(self, width, height=900):
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)

    def open(self, address, view="cells"):
        self.driver.get("about:blank")
        for log in ("browser", "performance"):
            self.driver.get_log(log)
        self.driver.get(f"{address}#view={view}" if view and "#" not in address else address)
        try:
            self.wait("return document.documentElement.dataset.ready === 'yes'")
        except TimeoutException:
            pytest.fail(f"the page is not shown: {self.complaints()}", pytrace=False)

    def wait(self, script, *arguments):
        """What a script returns as soon as that is something."""
        return WebDriverWait(self.driver, PATIENCE, 0.02).until(lambda _: self.ask(script, *arguments))

    def ask(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def complaints(self):
        """Warnings and errors on the console."""
        return [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]

    def requests(self):
        """Addresses that were asked for, but for those that are their own content."""
        events = [json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")]
        asked = [
            event["params"]["request"]["url"] for event in events if event["method"] == "Network.requestWillBeSent"
        ]
        return [address for address in asked if not address.startswith(("about:", "blob:", "data:"))]


@pytest.fixture(scope="session")
def window():
    found = {name: shutil.which(name) for name in ("chromium", "chromedriver")}
    if not all(found.values()):
        # No skip: what was not looked at would count as looked at.
        pytest.fail("no Chromium to look at pages with: apt-get install chromium chromium-driver", pytrace=False)
    options = webdriver.ChromeOptions()
    for flag in FLAGS.split():
        options.add_argument(flag)
    options.binary_location = found["chromium"]
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(found["chromedriver"]))
    yield Browser(driver)
    driver.quit()


@pytest.fixture
def browser(window):
    window.resize(1600)
    return window


def written(folder, groups, **attributes):
    """Address of the page of a dataset."""
    folder.mkdir(parents=True, exist_ok=True)
    tree = xr.DataTree.from_dict(groups)
    usual = {"springtune_version": st.__version__, "study": "mine", "title": "A study", "config": "title: A study"}
    tree.attrs = usual | attributes
    tree.to_netcdf(folder / "dataset.nc", engine="h5netcdf")
    path = folder / "index.html"
    path.write_text(page(folder / "dataset.nc"), encoding="utf-8")
    return path.as_uri()


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """Page of a small dataset of every group, with cells of every status and a group that nobody knows."""
    tree = dataset()
    groups = {node.path: node.to_dataset() for node in tree.subtree}
    status = groups["/"].status
    status.values.flat[1:6] = [0, 2, 3, 4, 5]
    message = xr.full_like(status, "", dtype=object)
    message.values.flat[5] = "the network <b>folded</b>"
    groups["/"] = groups["/"].assign(
        status=status.assign_attrs(flag_values=np.arange(6, dtype="int8"), flag_meanings=" ".join(STATUS)),
        message=message,
    )
    seconds = xr.full_like(groups["/"].deformation_error, 1e-3)
    groups["/"] = groups["/"].assign(solve_seconds=seconds, definition_seconds=2 * seconds)
    fields = groups["/fields"]
    forced = fields.displacement_x.isel(particle=0, drop=True) * xr.DataArray([-1e3, 0, 2e3], dims="spring")
    groups["/fields"] = fields.assign(force=forced.assign_attrs(units="N", long_name="force of each spring"))
    rain = (("town", "day"), [[1.0, np.nan, 3.0], [4.0, 5.0, 6.0]], {"units": "m", "long_name": "what fell"})
    weather = {"rain": rain, "wind": ((), 3.5, {"units": "m/s"})}
    weather["remark"] = ("town",), np.array(["wet", "dry"], dtype=object)
    groups["/weather"] = xr.Dataset(weather, {"town": ["here", "there"], "day": [1, 2, 3]})
    return written(tmp_path_factory.mktemp("small"), groups, title="<script>alert(1)</script>")


@pytest.fixture(scope="session")
def odd(tmp_path_factory):
    """Page with meshes of files, printed errors, loads against x, cells beyond their reference, samples, and a hole."""
    tree = dataset("shapes", "shape_fields", "samples", "sobol")
    made = {node.path: node.to_dataset(inherit=False) for node in tree.subtree}
    root = made["/"].assign_coords(mesh_size=[0.0, 2e-3, 5e-3])
    reference = xr.full_like(root.reference_displacement, 9.5e-3)
    reference.loc[{"load": "compression"}] *= -1
    applies = xr.ones_like(root.status.isel(dict.fromkeys(("mesh_type", "mesh_size", "definition"), 0), drop=True))
    applies.loc[{"load": "compression", "kinematics": "nonlinear"}] = 0
    values = {"displacement": 8.69e-3, "reference_displacement": 9.5e-3, "deformation_error": 0.0861}
    printed = {f"paper_{name}": xr.full_like(root.paper_displacement, value) for name, value in values.items()}
    printed["residual"] = xr.full_like(root.deformation_error, -1.2345e-13)
    root = root.assign(printed | {"reference_displacement": reference, "reference_applies": applies})
    root["deformation_error"] = -root.deformation_error
    declared = ROOT.empty(LABELS)
    for name in root:
        root[name].attrs = declared[name].attrs
    for data in (made["/shapes"], made["/samples"]):
        data["status"].attrs = declared.status.attrs
    root.mesh_size.attrs["units"] = "m"
    made["/shapes"].status.loc[{"shape": "hole"}] = 0
    made["/shapes"].error[{"mesh_size": 2}] = np.nan
    made["/shapes"].error.attrs["long_name"] = "signed error, (network - reference) / |reference|"
    fields = made["/shape_fields"]
    moved = 100 * fields.displacement_x  # by more than the body is long
    holed = fields.assign(outline_round=fields.outline_round + [0, 0, 1, 1], displacement_x=moved)
    return written(tmp_path_factory.mktemp("odd"), made | {"/": root, "/shape_fields": holed})


@pytest.fixture(scope="session")
def samples_alone(tmp_path_factory):
    """Page of samples without cells."""
    made = {node.path: node.to_dataset() for node in dataset("samples", "sobol").subtree}
    made["/samples"].status.attrs = ROOT.empty(LABELS).status.attrs
    return written(tmp_path_factory.mktemp("samples"), made | {"/": xr.Dataset()})


@pytest.fixture(scope="session")
def cube(tmp_path_factory):
    """Page of 10,000 cells, each with a curve of 61 points and with every variable of the root."""
    random = np.random.default_rng(12)
    axes = beside(__file__)["cube"] | {"stiffness_ratio": list(np.geomspace(0.35, 1.4, 61))}
    root, curves = ROOT.empty(axes), SENSITIVITY.empty(axes)
    for data in (root, curves):
        for array in data.values():
            if array.dtype.kind == "f":
                array.values[...] = random.normal(size=array.shape)
    assert root.status.size == 10_000
    root.status.values[...] = random.choice([1, 1, 1, 1, 4, 5], size=root.status.shape)
    root.message.values[root.status.values == 5] = "there is no equilibrium under the whole load"
    ratio, best = curves.stiffness_ratio.values, random.uniform(0.6, 1.1, size=curves.best_stiffness.shape)[..., None]
    curves.stiffness.values[...] = 2.1e8 * ratio
    curves.deformation_error.values[...] = best / ratio - 1
    curves.displacement.values[...] = random.lognormal(size=best.shape) * best / ratio
    curves.best_stiffness.values[...] = 2.1e8 * best[..., 0]
    curves.status.values[...] = 1
    return written(tmp_path_factory.mktemp("cube"), {"/": root, "/sensitivity": curves}, title="Ten thousand cells")
