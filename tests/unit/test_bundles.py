"""Bundles: balanced by measured cost, and stable where the study is."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from springtune.campaign.plan import usual_costs
from springtune.jobs import bundles, sealed
from springtune.jobs.spent import Spent
from springtune.kinds.stability.names import EXPERIMENTS
from springtune.springs import DEFINITIONS

USUAL = usual_costs()

COSTS = st.dictionaries(st.integers(0, 60).map("task {}".format), st.floats(1e-3, 30.0), min_size=1, max_size=40)


@given(costs=COSTS, cores=st.integers(1, 16), start_up=st.floats(0.1, 2.0))
def test_every_task_is_in_one_bundle_and_bundles_are_balanced(costs, cores, start_up):
    found = bundles.share_out(costs, cores, start_up, {})
    names = [name for members in found.values() for name in members]
    assert sorted(names) == sorted(costs)
    # Largest first to the least: no bundle has more than the even share and one task.
    even = sum(costs.values()) / len(found)
    assert max(sum(costs[name] for name in members) for members in found.values()) <= even + max(costs.values()) + 1e-9
    assert found == bundles.share_out(dict(reversed(costs.items())), cores, start_up, {})


@given(costs=COSTS, added=COSTS, cores=st.integers(1, 4), factor=st.floats(0.1, 10))
def test_what_was_shared_out_stays_where_it_is(costs, added, cores, factor):
    before = bundles.share_out(costs, cores, 0.5, {})
    dearer = {name: factor * cost for name, cost in costs.items()}
    assert bundles.share_out(dearer, cores, 0.5, before) == before
    after = bundles.share_out(costs | added, cores, 0.5, before)
    assert all(after[label][: len(members)] == members for label, members in before.items())
    assert sorted(name for members in after.values() for name in members) == sorted(costs | added)
    kept = bundles.share_out(added, cores, 0.5, after)
    assert all(set(kept[label]) <= set(after[label]) for label in kept)


@pytest.mark.parametrize("seconds, count", [(0.3, 1), (1.5, 2), (15.0, 2), (39.0, 4), (400.0, 40)])
def test_start_up_is_a_small_share_of_a_job_and_cores_are_kept_busy(seconds, count):
    costs = {str(number): seconds / 400 for number in range(400)}
    assert len(bundles.share_out(costs, 2, 0.5, {})) == count


def test_two_new_tasks_run_two_bundles_again():
    costs = {str(number): 1.0 for number in range(400)}
    before = bundles.share_out(costs, 2, 0.5, {})
    after = bundles.share_out(costs | {"new": 1.0, "newer": 1.0}, 2, 0.5, before)
    assert sum(after[label] != before.get(label) for label in after) == 2


def test_costs_follow_what_the_machine_measures(tmp_path):
    path, done = tmp_path / "costs.json", tmp_path / "done_0.json"
    assert bundles.Costs(path, USUAL).of("reference") == USUAL["reference"][0]
    spent = Spent()
    for _ in range(10):
        spent.add("reference", 0, 3 * USUAL["reference"][0])
        spent.add("a kind of no cost", 0, 1.0)
    sealed.write(done, spent.summary())
    bundles.remember(path, [done], USUAL)
    assert bundles.Costs(path, USUAL).of("reference") == pytest.approx(3 * USUAL["reference"][0])
    assert bundles.Costs(path, USUAL).start_up == spent.start_up + bundles.SPAWNED
    before = path.read_text()
    bundles.remember(path, [done], USUAL)  # the same jobs again say nothing new
    assert path.read_text() == before


def test_every_experiment_and_every_definition_that_searches_has_a_cost():
    assert set(EXPERIMENTS) <= set(USUAL)
    assert {name for name in ("adjoint", "annealed", "evolved") if name in DEFINITIONS} <= set(USUAL)
