"""Samples: designs that can be doubled, what is solved once, indices against closed forms, and failures that count."""

import contextlib
import shutil
from math import prod
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import stats

import springtune as st
from springtune.reference.answers import unit_scales
from springtune.reference.small_strain import solve_unit
from springtune.scene.mesh_cache import MeshCache
from springtune.studies.kinds import samples as designs
from springtune.studies.kinds.samples import DESIGNS, blocks, solve
from springtune.studies.kinds.samples.collect import ENDS, sobol_indices
from springtune.studies.kinds.samples.kind import MOST_SOLVED_ROWS
from springtune.studies.runs import store
from springtune.studies.runs.attempts import Attempts
from springtune.studies.runs.plan import stage_jobs

import tables
from campaigns import Campaign, load_text

LENGTHS, SIZES, RATIOS = "{from: 80 mm, to: 160 mm}", "{from: 10 mm, to: 15 mm}", "{from: 0, to: 0.4}"
MODULI = "{from: 1 GPa, to: 100 GPa, distribution: log-uniform}"
"""What tests put something else for."""


def study_text(*replaced, outputs="tables"):
    return tables.study_text("samples", *replaced, ("[tables]", f"[{outputs}]"))


@pytest.fixture(scope="module")
def references(tmp_path_factory):
    """Folder of the references that were interpolated so far: most samples here have the same."""
    return tmp_path_factory.mktemp("references")


@pytest.fixture
def here(tmp_path, monkeypatch, references):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "references").symlink_to(references)
    return tmp_path


def run(*replaced, name="sample", outputs="tables"):
    """Jobs of a study up to its dataset, in this process."""
    Path(f"{name}.yaml").write_text(study_text(*replaced, outputs=outputs))
    campaign = Campaign(f"{name}.yaml")
    campaign.write()
    shutil.copytree("references", campaign.folder / "samples", dirs_exist_ok=True)
    for job in campaign.jobs:
        if job in campaign.bundles or job == "collect":
            campaign.do(job)
    for path in campaign.jobs["interpolate_0"].products:
        shutil.copy(path, "references")
    with st.open(campaign.folder) as tree:
        return tree.load(), campaign


def solved():
    """Dataset of a small sample under two loads, with two definitions."""
    of = "load: [traction, compression]\n  definition: [lattice, area]"
    return run(("load: traction\n  definition: lattice", of), ("size: 16", "size: 8"))[0]


@pytest.fixture(scope="module")
def linear(tmp_path_factory, references):
    """That dataset, which several tests look at."""
    folder = tmp_path_factory.mktemp("linear")
    (folder / "references").symlink_to(references)
    with contextlib.chdir(folder):
        return solved()


class TestDesigns:
    PARAMETERS = tables.beside(__file__)["PARAMETERS"]

    @pytest.mark.parametrize("design", DESIGNS)
    def test_a_task_draws_its_part_of_the_sample(self, design):
        parts = [designs.draw(design, 3, self.PARAMETERS, *ends) for ends in blocks(design, 256)]
        together = designs.draw(design, 3, self.PARAMETERS, 0, 256)
        for name, values in together.items():
            assert np.concatenate([part[name] for part in parts]).tobytes() == values.tobytes()

    def test_values_follow_their_distributions(self):
        """Scrambled Sobol points have one value in each of as many strata."""
        drawn = designs.draw("sobol", 1, self.PARAMETERS, 0, 1024)
        for name, frozen in {
            "length": stats.uniform(0.1, 0.3),
            "height": stats.triang(1 / 6, 0.02, 0.06),
            "relative_mesh_size": stats.truncnorm(-2, 4, 0.2, 0.05),
            "young_modulus": stats.loguniform(1e6, 1e11),
        }.items():
            assert stats.kstest(drawn[name], frozen.cdf).statistic <= 1 / 1024 + 1e-9
        assert (drawn["thickness"] == 1e-3).all()
        assert (drawn["mesh_size"] == drawn["relative_mesh_size"] * drawn["height"]).all()

    def test_rows_of_a_base_sample_differ_in_one_parameter(self):
        drawn = designs.draw("sobol-indices", 1, self.PARAMETERS, 0, 8)
        names = designs.varied(self.PARAMETERS)
        table = np.stack([drawn[name] for name in names], axis=1).reshape(8, -1, len(names))
        for place in range(len(names)):
            differs = table[:, 2 + place] != table[:, 0]
            assert (differs == (np.arange(len(names)) == place)).all()
            assert (table[:, 2 + place, place] == table[:, 1, place]).all()


class TestIndices:
    @staticmethod
    def saltelli(function, size, dimensions):
        """Values at A, B and AB of a function of the unit cube."""
        a, b = np.split(designs.points(2 * dimensions, 1, 0, size), 2, axis=1)
        mixed = [np.where(np.arange(dimensions) == place, b, a) for place in range(dimensions)]
        return function(a), function(b), np.array([function(one) for one in mixed])

    @staticmethod
    def ishigami(points):
        x, y, z = (np.pi * (2 * points - 1)).T
        return np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)

    def test_ishigami(self):
        """Closed form: V = a^2/8 + b pi^4/5 + b^2 pi^8/18 + 1/2 (Ishigami and Homma 1990), a = 7, b = .1."""
        a, b, pi = 7.0, 0.1, np.pi
        v1, v2, v13 = 0.5 * (1 + b * pi**4 / 5) ** 2, a**2 / 8, b**2 * pi**8 * (1 / 18 - 1 / 50)
        first, total = np.array([v1, v2, 0.0]), np.array([v1 + v13, v2, v13])
        found = sobol_indices(*self.saltelli(self.ishigami, 4096, 3))
        for order, wanted in (("first", first / (v1 + v2 + v13)), ("total", total / (v1 + v2 + v13))):
            values, low, high = (found[f"{order}_order{end}"] for end in ENDS)
            assert ((low <= wanted) & (wanted <= high)).all()
            # Of 4096 points a Monte Carlo estimate is off by some hundredths, Sobol points by less.
            assert np.abs(values - wanted).max() < 0.02

    def test_the_same_as_scipy_has(self):
        at_a, at_b, at_ab = self.saltelli(self.ishigami, 256, 3)
        ours = sobol_indices(at_a, at_b, at_ab)
        theirs = stats.sobol_indices(
            func={"f_A": at_a[None], "f_B": at_b[None], "f_AB": at_ab[:, None]}, n=256, dists=None
        )
        np.testing.assert_allclose(ours["first_order"], theirs.first_order.ravel(), rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(ours["total_order"], theirs.total_order.ravel(), rtol=1e-9, atol=1e-9)


class TestOnce:
    """What is solved once for many scenes is what each of them would be."""

    NAMES = [name for name, one in st.DEFINITIONS.items() if not one.needs and name not in ("adjoint", "yeoh")]

    @pytest.mark.parametrize("name", NAMES)
    def test_an_answer_scales_with_force_over_young_modulus_and_thickness(self, name):
        type_name = "isosceles-0.3" if name == "axis-exact" else "structured"
        type_name = type_name if 3 in st.DEFINITIONS[name].cells else "braced"
        mesh = st.MESH_TYPES[type_name](0.1, 0.04, 0.01)
        kind, modulus, thickness, force = st.LOADS["traction"].kind, 3.7e9, 2.3e-3, 123.0
        unit, own = MeshCache(mesh, 1.0), MeshCache(mesh, thickness)
        once = unit.solve(kind, unit.derive(name, st.Material(1.0, 0.3))[0], 1.0, "linear").displacement
        solved = own.solve(kind, own.derive(name, st.Material(modulus, 0.3))[0], force, "linear").displacement
        assert solved == pytest.approx(force / (modulus * thickness) * once, rel=1e-9)

    @pytest.mark.parametrize("name", ["uniform", "lattice", "area", "delingette"])
    def test_a_sheet_like_another_has_the_same_numbers_to_the_bit(self, name):
        before = MeshCache(st.MESH_TYPES["structured"](0.1, 0.04, 0.01), 1.0)
        kind = st.LOADS["bending"].kind
        before.solve(kind, before.derive(name, st.Material(1.0, 0.3))[0], 1.0, "linear")
        box = (0.103, 0.0391, 0.01)
        answers = []
        for like in (None, before):
            cache = MeshCache(st.MESH_TYPES["structured"](*box), 1.0, like=like)
            springs, _ = cache.derive(name, st.Material(1.0, 0.3))
            answers += [cache.solve(kind, springs, 1e-4, how).displacement for how in ("linear", "nonlinear")]
        assert answers[:2] == answers[2:]
        assert cache.mesh.edges is before.mesh.edges

    def test_sampled_scenes_are_those_of_a_sheet_each(self, linear):
        data = linear["samples"].to_dataset()
        for row in range(0, data.sizes["sample"], 7):
            one = data.isel(sample=row)
            box = [float(one[name]) for name in ("length", "height", "sample_mesh_size")]
            cache = MeshCache(st.MESH_TYPES["structured"](*box), float(one.thickness))
            for load in ("traction", "compression"):
                for name in ("lattice", "area"):
                    material = st.Material(float(one.young_modulus), float(one.poisson_ratio))
                    springs, _ = cache.derive(name, material)
                    force = st.LOADS[load].sign * float(one.force)
                    wanted = cache.solve(st.LOADS[load].kind, springs, force, "linear")
                    found = one.sel(load=load, definition=name)
                    assert int(found.status) == wanted.status
                    assert float(found.displacement) == pytest.approx(wanted.displacement, rel=1e-9)


class TestClosedForm:
    @pytest.mark.slow
    def test_indices_of_a_product_are_within_their_bands(self, here):
        """Linear triangles at nu = 0 stretch evenly: u = F L / (E t H) on any mesh, whatever the clamp.

        Of a product of independent factors, each of relative variance v, the variance is prod(1 + v) - 1, the part of
        one factor alone v, and its total one v prod of the other (1 + v).
        """
        tree, _ = run(
            ("size: 16", "size: 256"), ("definition: lattice\n  parameters", "definition: delingette\n  parameters"),
            ("thickness: 1 mm", "thickness: {from: 1 mm, to: 2 mm}"), (RATIOS, "0"),
            (MODULI, MODULI.replace("100", "2")),
        )  # fmt: skip
        cell = {"load": "traction", "definition": "delingette"}
        data, found = tree["samples"].to_dataset(), tree["sobol"].to_dataset().sel(cell)
        exact = data.force * data.length / (data.young_modulus * data.thickness * data.height)
        np.testing.assert_allclose(data.displacement.sel(cell), exact, rtol=1e-9)
        assert float(abs(data.deformation_error.sel(definition="delingette")).max()) < 1e-4  # which references have

        def uniform(low, high):  # relative variance
            return (high - low) ** 2 / 12 / ((high + low) / 2) ** 2

        def inverse(low, high):  # of 1 over a uniform one: its moments are ln(b/a)/(b - a) and 1/(a b)
            return 1 / (low * high) / (np.log(high / low) / (high - low)) ** 2 - 1

        variance = {"length": uniform(80, 160), "height": inverse(20, 40), "thickness": inverse(1, 2), "mesh_size": 0.0,
                    # of 1 / E with a uniform logarithm: (1/a - 1/b) / ln(b/a), and half of (1/a^2 - 1/b^2) / ln(b/a)
                    "young_modulus": 0.5 * (1 - 1 / 4) * np.log(2) / (1 - 1 / 2) ** 2 - 1,
                    "force": uniform(1, 5)}  # fmt: skip
        assert found.parameter.values.tolist() == list(variance)
        every = prod(1 + v for v in variance.values())
        of = found.sel(quantity="displacement")
        for name, v in variance.items():
            one = of.sel(parameter=name)
            first, total = v / (every - 1), v * every / (1 + v) / (every - 1)
            # At 95 % one of twelve bands may miss; those of this seed do not.
            assert float(one.first_order_low) - 1e-9 <= first <= float(one.first_order_high) + 1e-9
            assert float(one.total_order_low) - 1e-9 <= total <= float(one.total_order_high) + 1e-9
        # An error within what references are known to has no parts.
        assert np.isnan(found.sel(quantity="deformation_error").first_order).all()


class TestRuns:
    def test_a_doubled_size_and_a_further_definition_solve_nothing_again(self, here):
        small, _ = run(name="sample")
        new = [
            path for path in Path("results/sample/samples").iterdir() if not (Path("references") / path.name).exists()
        ]
        files = {path: path.stat().st_mtime_ns for path in new}
        large, campaign = run(("size: 16", "size: 32"), name="sample")
        assert {path: path.stat().st_mtime_ns for path in files} == files
        count = small["samples"].sizes["sample"]
        assert large["samples"].sizes["sample"] == 2 * count
        before, after = (tree["samples"].to_dataset().isel(sample=slice(count)) for tree in (small, large))
        xr.testing.assert_identical(before.drop_attrs(), after.drop_attrs())
        assert campaign.due()[-2:] == ["present_scenes", "browse"]
        before = {path: store.stored_keys(path) for path in new}
        further = ("definition: lattice\n  parameters", "definition: [lattice, van-gelder]\n  parameters")
        tree, _ = run(("size: 16", "size: 32"), further, name="sample")
        assert [len(store.stored_keys(path) - keys) for path, keys in before.items()] == [1] * len(before)
        assert (tree["samples"].status.sel(load="traction") == st.Status.SOLVED).all()

    @pytest.mark.slow
    def test_a_sample_needs_neither_grids_nor_beams_nor_materials(self, here):
        """Its values are those beside a grid; other groups of scenes are not there."""
        beside, _ = run()
        text = study_text()
        (here / "alone.yaml").write_text(
            text[: text.index("beams:")] + text[text.index("outputs:") : text.index("grids:")]
        )
        campaign = Campaign("alone.yaml")
        campaign.finish()
        with xr.open_datatree(campaign.folder / "dataset.nc", engine="h5netcdf") as tree:
            found, expected = (one["samples"].to_dataset(inherit=False).load() for one in (tree, beside))
            assert not tree.to_dataset().data_vars
            for name in found.data_vars:
                assert found[name].variable.equals(expected[name].variable), name
        assert all((campaign.folder / name).exists() for name in ("index.html", "summary.txt", "tables/sobol.csv"))

    def test_designs_without_rows_of_a_pair_have_no_indices(self, here):
        tree, _ = run(("size: 16", "size: 64\n  design: sobol"))
        assert "sobol" not in tree and "role" not in tree["samples"].coords
        assert tree["samples"].sizes["sample"] == 64

    def test_best_stiffness_is_where_the_uniform_network_meets_the_reference(self, linear):
        one = linear["samples"].to_dataset().isel(sample=3).sel(load="traction")
        box = [float(one[name]) for name in ("length", "height", "sample_mesh_size")]
        cache = MeshCache(st.MESH_TYPES["structured"](*box), float(one.thickness))
        springs, _ = cache.derive("uniform", st.Material(float(one.best_stiffness) / float(one.thickness), 0.3))
        found = cache.solve(st.LOADS["traction"].kind, springs, float(one.force), "linear").displacement
        # Springs of k have sqrt(3)/2 E t = k at that E.
        assert found * np.sqrt(0.75) == pytest.approx(float(one.reference_displacement), rel=1e-9)


class TestFailures:
    @pytest.mark.slow
    def test_base_samples_of_which_a_scene_has_no_value_are_dropped_and_counted(self, here):
        """Some networks with area energies are unstable: one row of cells at small nu."""
        area = ("definition: lattice\n  parameters", "definition: area\n  parameters")
        tree, _ = run(("size: 16", "size: 32"), area, (SIZES, "{from: 10 mm, to: 20 mm}"))
        data, found = tree["samples"].to_dataset(), tree["sobol"].to_dataset().sel(load="traction", definition="area")
        solved = (data.status.sel(load="traction", definition="area") == st.Status.SOLVED).values.reshape(32, -1)
        assert 0 < (~solved).sum() < solved.size
        lost = int((~solved.all(axis=1)).sum())
        error = found.sel(quantity="deformation_error")
        assert (int(error.base_samples_without), int(error.base_samples)) == (lost, 32 - lost)
        assert np.isfinite(error.first_order).all()
        messages = data.message.sel(load="traction", definition="area").values[~solved.ravel()]
        assert all("negative pivot" in text for text in messages)
        assert "left out" in tree["sobol"].attrs["failures"]

    def test_a_sample_that_is_singular_is_a_hole_and_the_others_are_solved(self, tmp_path):
        """One row of cells at nu = 0 is a mechanism with area energies, and where it is lies in the last digits."""
        how = (
            ("size: 16", "size: 8\n  design: sobol"),
            ("definition: lattice\n  p", "definition: patch-area\n  p"),
            (f"mesh_size: {SIZES}", "relative_mesh_size: 1"),
            ("height: {from: 20 mm, to: 40 mm}", "height: 40 mm"),
            (RATIOS, "0"),
        )
        spent = Attempts({})
        _, results = networks(tmp_path, *how, spent=spent)
        assert not spent.broken
        status = results[0]["status"]
        assert set(np.flatnonzero(status != st.Status.SOLVED)) == set(map(int, results[0]["messages"]))
        assert 0 < len(results[0]["messages"]) < 8


class TestReferences:
    """Where aspect ratios and Poisson's ratios have no interpolant within the tolerance of references."""

    PLAIN = ("size: 16", "size: 8\n  design: sobol")

    @staticmethod
    def without(folder, *replaced):
        """Store what a build that is not certified stores; the task and the file."""
        study = load_text(folder, study_text(*replaced))
        content, _ = content_of("interpolate", study, folder / "samples_of")
        path = file_of(content)
        store.add(path, {path.stem: {"message": "no interpolant", "seconds": 0.0, "asked": 0}})
        return content, path

    def collected(self, folder, monkeypatch, *replaced):
        """Group ``/samples`` of one without an interpolant, and the summary."""
        _, path = self.without(folder, *replaced)
        monkeypatch.chdir(folder)
        (folder / "references").mkdir()
        shutil.copy(path, "references")
        tree, campaign = run(*replaced)
        data = tree["samples"].to_dataset().sel(load="traction", definition="lattice")
        return data, (campaign.folder / "summary.txt").read_text()

    def test_those_of_a_small_sample_are_solved_one_by_one(self, tmp_path, monkeypatch):
        data, summary = self.collected(tmp_path, monkeypatch, self.PLAIN)
        assert (data.reference_error_estimate <= 1e-4).all() and (data.reference_applies == 1).all()
        assert data.deformation_error.notnull().all() and data.reference_message.item() == ""
        one = data.isel(sample=5)
        kind = st.LOADS["traction"].kind
        alone = solve_unit(float(one.length / one.height), float(one.poisson_ratio), kind)
        material = st.Material(float(one.young_modulus), float(one.poisson_ratio))
        _, scale = unit_scales(one, material, kind)
        assert float(one.reference_displacement) == pytest.approx(float(one.force * scale) * alone.displacement)
        assert "without a reference" not in summary

    def test_those_of_a_large_one_are_holes_that_the_summary_tells_of(self, tmp_path, monkeypatch):
        """Of one network: all that varies is the force."""
        fixed = ((LENGTHS, "80 mm"), ("{from: 20 mm, to: 40 mm}", "40 mm"), (SIZES, "20 mm"), (RATIOS, "0.3"))
        size = ("size: 16", f"size: {2 * MOST_SOLVED_ROWS}\n  design: sobol")
        data, summary = self.collected(tmp_path, monkeypatch, *fixed, size)
        assert data.deformation_error.isnull().all() and (data.reference_applies == 0).all()
        assert "no interpolant; up to 1024 points they would be solved one by one" in data.reference_message.item()
        assert "samples without a reference, and so without an error: 2048 of 2048\n" in summary
        assert data.reference_message.item() in summary


def networks(folder, *replaced, spent=None):
    """Content of the networks of a sample of one load and definition, and the results of these."""
    folder.mkdir(exist_ok=True)
    study = load_text(folder, study_text(*replaced))
    content, file = content_of("sample", study, folder)
    solve.run(content, spent or Attempts({}))
    fields = ("displacement", "status", "particles")
    found = [store.read(path, [*file["results"]], fields) for path in [file_of(content)]]
    return content, [block[key] for block in found for key in file["results"]]


def content_of(name, study, folder):
    """Content of a job with all tasks of a stage of samples, and its first file."""
    (content,) = (job.content for job in stage_jobs(study, folder).values() if job.stage.name == name)
    return content, content["files"][0]


def file_of(content):
    """The only file that a job makes."""
    (file,) = content["files"]
    return Path(content["folder"]) / f"{file['name']}.h5"
