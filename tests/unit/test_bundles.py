"""Bundles: balanced by measured cost, and stable where the study is."""

import os
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from springtune.springs import DEFINITIONS
from springtune.studies.kinds import load_study
from springtune.studies.kinds.stability import EXPERIMENTS
from springtune.studies.runs import checked_json, plan, records, workload
from springtune.studies.runs.task_costs import TaskCosts

from tables import STUDIES

USUAL = plan.usual_costs()

COSTS = st.dictionaries(st.integers(0, 60).map("task {}".format), st.floats(1e-3, 30.0), min_size=1, max_size=40)


@given(costs=COSTS, cores=st.integers(1, 16), start_up=st.floats(0.1, 2.0))
def test_every_task_is_in_one_bundle_and_bundles_are_balanced(costs, cores, start_up):
    found = plan.share_out(costs, cores, start_up, {})
    names = [name for members in found.values() for name in members]
    assert sorted(names) == sorted(costs)
    # Largest first to the least: no bundle has more than the even share and one task.
    even = sum(costs.values()) / len(found)
    assert max(sum(costs[name] for name in members) for members in found.values()) <= even + max(costs.values()) + 1e-9
    assert found == plan.share_out(dict(reversed(costs.items())), cores, start_up, {})


@given(costs=COSTS, added=COSTS, cores=st.integers(1, 4), factor=st.floats(0.1, 10))
def test_what_was_shared_out_stays_where_it_is(costs, added, cores, factor):
    before = plan.share_out(costs, cores, 0.5, {})
    dearer = {name: factor * cost for name, cost in costs.items()}
    assert plan.share_out(dearer, cores, 0.5, before) == before
    after = plan.share_out(costs | added, cores, 0.5, before)
    assert all(after[label][: len(members)] == members for label, members in before.items())
    assert sorted(name for members in after.values() for name in members) == sorted(costs | added)
    kept = plan.share_out(added, cores, 0.5, after)
    assert all(set(kept[label]) <= set(after[label]) for label in kept)


@pytest.mark.parametrize("seconds, count", [(0.3, 1), (1.5, 2), (15.0, 2), (39.0, 4), (400.0, 40)])
def test_start_up_is_a_small_share_of_a_job_and_cores_are_kept_busy(seconds, count):
    costs = {str(number): seconds / 400 for number in range(400)}
    assert len(plan.share_out(costs, 2, 0.5, {})) == count


@given(costs=COSTS, lasting=st.floats(1.0, 100.0))
def test_on_a_cluster_a_job_lasts_as_long_as_is_wanted(costs, lasting):
    found = plan.share_out(costs, 1, 0.5, {}, lasting)
    assert sorted(name for members in found.values() for name in members) == sorted(costs)
    loads = [sum(costs[name] for name in members) for members in found.values()]
    # As near as whole bundles can be, and tasks are not torn apart.
    assert len(found) == max(1, min(round(sum(costs.values()) / lasting), len(costs)))
    assert max(loads) <= 1.5 * lasting + max(costs.values()) + 1e-9


def test_a_job_asks_for_what_it_is_expected_to_need_and_twice_that_at_each_retry():
    needs = plan.Needs(seconds=1000.0, memory=3e9, most_memory=8e9)
    least = plan.TIME_MARGIN * needs.seconds / 60, plan.MEMORY_MARGIN * needs.memory / 1e6
    asked = [(needs.minutes(attempt), needs.megabytes(attempt)) for attempt in (1, 2, 3, 4)]
    assert least[0] + plan.QUEUED / 60 <= asked[0][0] <= least[0] + plan.QUEUED / 60 + 1
    assert asked[0][1] == least[1]
    assert asked[1] == (2 * asked[0][0], 2 * asked[0][1])
    assert [minutes for minutes, _ in asked] == [asked[0][0] * 2**retry for retry in range(4)]
    # No task may need more than the study's limits allow.
    assert asked[2][1] == asked[3][1] == (8e9 + plan.LEAST_MEMORY) / 1e6


def test_before_anything_was_measured_a_job_asks_for_some_memory_and_never_for_too_little():
    assert plan.Needs(1.0).megabytes(1) == plan.MEMORY / 1e6
    assert plan.Needs(1.0, memory=1.0).megabytes(1) == plan.LEAST_MEMORY / 1e6


def test_memory_follows_the_largest_job_of_a_stage_and_forgets_slowly(tmp_path):
    path = tmp_path / "costs.json"

    def run(**memory):
        done = [tmp_path / f"{job}.json" for job in memory]
        for file, most in zip(done, memory.values()):
            checked_json.write(
                file, {"start_up": 0.1, "work": {"reference": [1, 0, 1.0]} if most else {}, "memory": most}
            )
            os.utime(file, (time.time() + 10,) * 2)
        plan.remember_costs(path, done, USUAL)
        os.utime(path)
        return plan.Costs(path, USUAL).memory

    assert run(solve_0=2e9, solve_1=4e9, mesh_0=1e9) == {"solve": 4e9, "mesh": 1e9}
    assert run(solve_0=1e8) == {"solve": 2e9, "mesh": 1e9}
    assert run(solve_0=0) == {"solve": 2e9, "mesh": 1e9}  # it found all stored
    assert run(solve_0=3e9) == {"solve": 3e9, "mesh": 1e9}


STUDY = STUDIES["bundles"]


@pytest.fixture
def planned(tmp_path):
    """Function that plans a study of six meshes, with or without writing it."""
    (tmp_path / "six.yaml").write_text(STUDY)
    study, folder = load_study(tmp_path / "six.yaml"), tmp_path / "results/six"

    def planned(cores=1, lasting=None, write=False):
        found = plan.plan(study, folder, cores, lasting)
        if write:
            found.write()
        return found

    return planned


def test_who_only_computes_plans_as_the_run_did(planned):
    """A job's own reading and the stage `collect` know neither the machine of the run nor its profile."""
    wanted = planned(lasting=1e-4, write=True)
    assert len(wanted.labels("mesh")) == 6
    assert planned().jobs == wanted.jobs and planned().bundles == wanted.bundles
    assert planned(cores=2, lasting=0.0).labels("mesh") != wanted.labels("mesh")


def test_what_is_done_stays_in_its_bundle_where_others_are_wanted(planned):
    before = planned(lasting=1e-4, write=True)
    for label in before.labels("mesh")[:2]:
        for stage in ("mesh", "solve"):
            name = f"{stage}_{label}"
            records.write(before.record(name), before.jobs[name].digest, [])
    after = planned(cores=2, lasting=0.0)
    kept, others = before.labels("mesh")[:2], set(after.labels("mesh"))
    assert all(after.jobs[f"mesh_{label}"] == before.jobs[f"mesh_{label}"] for label in kept)
    # The four that are left are one bundle, or go to one that is there.
    assert len(others) < 6 and sum(len(names) for names in after.bundles["mesh"].values()) == 6
    # What was done of something else is not done.
    records.write(before.record(f"solve_{kept[0]}"), "of before", [])
    assert planned(cores=2, lasting=0.0).jobs[f"mesh_{kept[1]}"] == before.jobs[f"mesh_{kept[1]}"]
    assert len(planned(cores=2, lasting=0.0).labels("mesh")) <= len(others)


def test_stages_of_a_bundle_have_its_seconds(planned):
    made = planned(lasting=1e-4)
    assert made.needs["mesh", "0"].seconds == made.needs["solve", "0"].seconds > 0
    assert made.needs["mesh", "0"].most_memory == made.limits["memory"]


def test_costs_follow_what_the_machine_measures(tmp_path):
    path, done = tmp_path / "costs.json", tmp_path / "done_0.json"
    assert plan.Costs(path, USUAL).of("reference") == USUAL["reference"][0]
    spent = TaskCosts()
    for _ in range(10):
        spent.add("reference", 0, 3 * USUAL["reference"][0])
        spent.add("a kind of no cost", 0, 1.0)
    checked_json.write(done, spent.summary())
    plan.remember_costs(path, [done], USUAL)
    assert plan.Costs(path, USUAL).of("reference") == pytest.approx(3 * USUAL["reference"][0])
    assert plan.Costs(path, USUAL).start_up == spent.start_up + plan.SPAWNED
    before = path.read_text()
    plan.remember_costs(path, [done], USUAL)  # the same jobs again say nothing new
    assert path.read_text() == before


def test_every_experiment_and_every_definition_that_searches_has_a_cost():
    assert set(EXPERIMENTS) <= set(USUAL)
    assert {name for name in ("adjoint", "annealed", "evolved") if name in DEFINITIONS} <= set(USUAL)


def test_commands_are_those_of_their_job_alone(tmp_path):
    told = [{"rule": rule, "wildcards": {"bundle": label}, "command": f"{rule} {label}"}
            for rule in ("mesh", "solve") for label in "01"]  # fmt: skip
    assert workload.recall_command(tmp_path, "solve", {"bundle": "1"}) is None
    workload.remember_commands(tmp_path, [*told, {"rule": "collect", "wildcards": {}, "command": "collect"}])
    assert workload.recall_command(tmp_path, "solve", {"bundle": "1"})["command"] == "solve 1"
    assert workload.recall_command(tmp_path, "collect", {})["command"] == "collect"
    assert workload.recall_command(tmp_path, "solve", {"bundle": "2"}) is None
