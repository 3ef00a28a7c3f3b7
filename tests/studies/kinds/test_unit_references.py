"""Which references of a study come from interpolants, and what is made of them."""

import numpy as np
import pytest
import yaml

import springtune as st
from springtune.reference.interpolant import TOLERANCE
from springtune.studies.kinds.bodies import any_reference, collect
from springtune.studies.kinds.bodies import kind as bodies
from springtune.studies.kinds.bodies.kind import interpolants, reference_of, solved_reference, summary
from springtune.studies.runs import store
from springtune.studies.runs.plan import stage_jobs

from campaigns import do_stages
from tables import STUDIES

MANY, FEW = 32, 20


@pytest.fixture(autouse=True)
def few_alone(monkeypatch):
    monkeypatch.setattr(bodies, "MOST_SOLVED_ALONE", 25)


def text(lengths, outputs=("size",), definition="lattice"):
    """A study of beams of one height."""
    study = yaml.safe_load(STUDIES["many_lengths"]) | {"outputs": [*outputs]}
    study["beams"] = {f"b{one}": {"length": f"{mm:.6g} mm", "height": "10 mm"} for one, mm in lengths.items()}
    study["grids"]["all"] |= {"beam": [*study["beams"]], "definition": definition}
    return yaml.safe_dump(study, sort_keys=False)


def lengths(count):
    return {number: length for number, length in enumerate(np.linspace(20.5, 29.5, count))}


@pytest.fixture
def load(tmp_path):
    def load(*parts, **options):
        path = tmp_path / "study.yaml"
        path.write_text(text(*parts, **options))
        return st.load_study(path)

    return load


def references(study):
    return [reference_of(study, one.beam, one.material, one.load) for one in study.references]


def test_few_references_are_solved_by_themselves(load):
    study = load(lengths(FEW))
    assert interpolants(study) == {}
    assert references(study) == [solved_reference(one.beam, one.material, one.load) for one in study.references]


def test_many_references_come_from_an_interpolant(load):
    study = load(lengths(MANY))
    box, problems = interpolants(study)["axial"]
    assert (len(problems), box) == (MANY, ((1.995262, 3.162278), (0.3, 0.3)))
    assert len({one["interpolant"] for one in references(study)}) == 1
    assert "from 1 interpolant: " in summary(study, [])


def test_values_added_inside_the_box_leave_the_interpolant_as_it_is(load):
    before = references(load(lengths(MANY)))
    more = load(lengths(MANY) | {100: 20.1, 101: 24.9, 102: 31.0})
    assert references(more)[:MANY] == before
    (box, _), (wider, _) = (interpolants(one)["axial"] for one in (more, load(lengths(MANY) | {100: 39.0, 101: 40.0})))
    assert wider != box


WHOLE = ({"outputs": ["size", "deformed"]}, {"outputs": ["size", "deformed", "tables"]})


@pytest.mark.parametrize("options", (*WHOLE, {"definition": ["lattice", "annealed"]}), ids=str)
def test_where_whole_fields_are_asked_for_references_are_solved_by_themselves(load, options):
    assert interpolants(load(lengths(MANY), **options)) == {}


def test_the_dataset_is_that_of_references_solved_by_themselves(load, tmp_path):
    study = load(lengths(MANY))
    do_stages(study, tmp_path / "results", "reference", "mesh", "solve")
    root = collect.groups(study, tmp_path / "results")["/"]
    # Two of them, in a study of their own.
    few = load({number: lengths(MANY)[number] for number in (3, 17)})
    do_stages(few, tmp_path / "few", "reference", "mesh", "solve")
    alone = collect.groups(few, tmp_path / "few")["/"]
    for name in ("reference_displacement", "deformation_error"):
        there = root[name].sel(beam=alone.beam).squeeze()
        sure = float(root.reference_error_estimate.max() + alone.reference_error_estimate.max())
        np.testing.assert_allclose(there, alone[name].squeeze(), atol=sure, rtol=sure)
    assert 0 < root.reference_error_estimate.max() <= TOLERANCE
    assert "32 of 32 are interpolated" in root.reference_displacement.attrs["comment"]
    assert root.field_error.isnull().all() and alone.field_error.notnull().all()
    assert "comment" not in alone.reference_displacement.attrs
    assert (root.reference_applies == 1).all() and root.reference_seconds.notnull().all()


def test_what_cannot_be_interpolated_is_solved_by_itself(load, tmp_path):
    study = load(lengths(MANY))
    (content,) = [job.content for job in stage_jobs(study, tmp_path).values() if job.stage.name == "reference"]
    (task,) = (task for file in content["files"] for task in file["tasks"])
    # What a build that is not certified stores.
    path = tmp_path / "references" / f"{task['key']}.h5"
    path.parent.mkdir(parents=True)
    store.add(path, {task["key"]: {"message": "no interpolant", "seconds": 1.0, "asked": MANY}})
    before = any_reference.read(path.parent, references(study)[0])
    assert before == {"message": "no interpolant", "seconds": 0.0}
    do_stages(study, tmp_path, "reference")
    found = [any_reference.read(path.parent, one) for one in references(study)]
    assert all(one["error_estimate"] <= 1e-4 and "solves" not in one for one in found)
    few = load({0: lengths(MANY)[0]})
    do_stages(few, tmp_path / "few", "reference")
    alone = any_reference.read(tmp_path / "few" / "references", references(few)[0])
    assert {name: value for name, value in found[0].items() if name != "seconds"} == {
        name: value for name, value in alone.items() if name != "seconds"
    }
