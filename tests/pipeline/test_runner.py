"""Reuse by content, reasons for staleness, skipping, and nothing half-written."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import pytest

from mrpipe.artifacts import Artifact, sha256_of
from mrpipe.artifacts.plain import plain, to_json
from mrpipe.errors import StageSkipped, UserError
from mrpipe.pipeline.code_version import code_version
from mrpipe.pipeline.fingerprint import digest_of_artifact
from mrpipe.pipeline.lock import run_lock
from mrpipe.pipeline.manifest import Manifest, StageKey, reasons_stale
from mrpipe.pipeline.parts import read_part
from mrpipe.pipeline.stage import StageContext

from .conftest import CALLS, STAGES, MakePipeline, with_run


@pytest.mark.property
def test_builds_what_is_missing_and_nothing_else(make_pipeline: MakePipeline) -> None:
    assert make_pipeline().build("second").what == "built"
    assert CALLS == ["first", "second"]
    again = make_pipeline()
    assert again.build("second").what == "reused"
    assert CALLS == ["first", "second"]
    assert again.outcomes["first"].manifest.warnings == ["the first is only a test"]


@pytest.mark.property
def test_summary_survives_reuse_and_is_plain_json(make_pipeline: MakePipeline) -> None:
    first = make_pipeline().build("first").manifest.summary
    assert make_pipeline().build("first").manifest.summary == first == {"rms_m": 1.5, "not_finite": None}


STALE = {
    "setting": ({"prepare": {"cutoff_hz": 80.0}}, "setting prepare.cutoff_hz was 100.0, is 80.0"),
    "seed": ({"seed": 5}, "seed was 2011, is 5"),
}


@pytest.mark.property
@pytest.mark.parametrize("cause", STALE)
def test_change_is_named_and_built_again(cause: str, make_pipeline: MakePipeline) -> None:
    changes, reason = STALE[cause]
    make_pipeline().build("second")
    changed = make_pipeline(**changes)
    assert changed.status(["second"])["first"] == [reason]
    assert changed.status(["second"])["second"][0] == "first, which it reads, is stale"
    assert changed.build("second").what == "built"
    assert changed.outcomes["first"].reasons == [reason]


@pytest.mark.property
def test_setting_that_no_stage_reads_makes_nothing_stale(make_pipeline: MakePipeline) -> None:
    make_pipeline().build("second")
    assert make_pipeline(execution={"jobs": 3}, prepare={"order": 3}).build("second").what == "reused"


@pytest.mark.property
def test_same_numbers_built_again_leave_the_next_stage_alone(make_pipeline: MakePipeline) -> None:
    make_pipeline().build("second")
    forced = make_pipeline()
    forced.force = frozenset(["first"])
    assert forced.build("second").what == "reused"
    assert CALLS == ["first", "second", "first"]


@pytest.mark.property
@pytest.mark.parametrize("harm", ["remove", "change"])
def test_output_harmed_by_other_hands_is_built_again(harm: str, make_pipeline: MakePipeline) -> None:
    pipeline = make_pipeline()
    pipeline.build("first")
    path = pipeline.run_directory / "first.h5"
    if harm == "remove":
        path.unlink()
    else:
        with h5py.File(path, "a") as handle:
            handle["values"][0] = 9.0
    expected = (
        "output first.h5 is missing"
        if harm == "remove"
        else "output first.h5 was changed or damaged after it was written"
    )
    again = make_pipeline()
    assert again.status(["first"])["first"] == [expected]
    assert again.build("first").reasons == [expected]


@pytest.mark.property
def test_the_artifact_of_a_stale_stage_is_not_called_missing(make_pipeline: MakePipeline) -> None:
    """`input first is missing` sends people to look for a file that is there."""
    make_pipeline().build("second")
    path = make_pipeline().run_directory / "first.h5"
    with h5py.File(path, "a") as handle:
        handle["values"][0] = 9.0
    assert make_pipeline().status(["second"])["second"] == ["first, which it reads, is stale"]


@pytest.mark.property
def test_code_change_is_named(make_pipeline: MakePipeline) -> None:
    pipeline = make_pipeline()
    pipeline.build("first")
    path = pipeline.run_directory / "manifests" / "first.json"
    content = json.loads(path.read_text())
    content["key"]["code"]["mrpipe.signals"] = "0" * 16
    path.write_text(json.dumps(content))
    assert make_pipeline().status(["first"])["first"] == ["code of mrpipe.signals changed"]


@pytest.mark.property
def test_code_version_follows_imports_but_not_the_runner() -> None:
    version = code_version("mrpipe.structures.frame")
    assert {"mrpipe.structures.frame", "mrpipe.artifacts.hdf5", "mrpipe.errors"} <= set(version)
    assert not any(name.startswith(("mrpipe.pipeline", "mrpipe.cli", "mrpipe.config")) for name in version)


@pytest.mark.property
def test_stage_without_campaign_is_skipped_with_all_after_it(make_pipeline: MakePipeline) -> None:
    outcome = make_pipeline().build("after")
    assert outcome.what == "skipped"
    assert "there is no frame campaign" in outcome.manifest.skipped
    assert CALLS == []


@pytest.mark.property
def test_a_stage_that_was_skipped_for_lack_of_data_is_called_never_built(make_pipeline: MakePipeline) -> None:
    """It had been compared with nothing: every setting and every file of code had changed."""
    pipeline = make_pipeline()
    pipeline.build("after")
    manifest = Manifest.load(pipeline.run_directory / "manifests", "shaken")
    key = StageKey({"campaign:frame": "1"}, {"prepare": {"cutoff_hz": 100.0}}, {"mrpipe.signals": "2"}, 2011)
    assert reasons_stale(manifest, key, pipeline.run_directory, pipeline.hashes) == ["never built"]


@pytest.mark.property
def test_nothing_is_built_for_a_stage_that_lacks_a_campaign(make_pipeline: MakePipeline) -> None:
    whole = replace(STAGES["after"], name="whole", inputs=("second", "after"), outputs=("whole.h5",))
    outcome = make_pipeline({**STAGES, "whole": whole}).build("whole")
    assert outcome.what == "skipped"
    assert "there is no frame campaign" in outcome.manifest.skipped
    assert CALLS == []


@pytest.mark.property
def test_optional_input_is_used_where_it_is_there(make_pipeline: MakePipeline) -> None:
    assert make_pipeline().build("third").what == "built"
    assert CALLS == ["first", "second", "third"]


@pytest.mark.property
def test_a_known_input_is_used_if_it_is_up_to_date_and_never_built(make_pipeline: MakePipeline) -> None:
    stages = {**STAGES, "third": replace(STAGES["third"], optional_inputs=(), known_inputs=("second",))}
    make_pipeline(stages).build("third")
    assert CALLS == ["third"]
    make_pipeline(stages).build("second")
    assert make_pipeline(stages).status(["third"])["third"] == ["input second is new"]
    make_pipeline(stages).build("third")
    assert CALLS == ["third", "first", "second", "third"]
    # out of date: it is left out again, and not built
    make_pipeline(stages, prepare={"cutoff_hz": 80.0}).build("third")
    assert CALLS == ["third", "first", "second", "third", "third"]


@pytest.mark.property
def test_a_setting_may_ask_for_a_further_input(make_pipeline: MakePipeline) -> None:
    conditional = replace(STAGES["third"], optional_inputs=(), conditional_inputs=(("seed", 5, "second"),))
    make_pipeline({**STAGES, "third": conditional}).build("third")
    assert CALLS == ["third"]
    make_pipeline({**STAGES, "third": conditional}, seed=5).build("third")
    assert CALLS == ["third", "first", "second", "third"]


@pytest.mark.property
def test_the_settings_that_make_a_stage_need_a_campaign_are_named(make_pipeline: MakePipeline) -> None:
    demands = (("calibrate.damper", "identified", "shaken"), ("calibrate.expected_amplitude_m", None, "shaken"))
    third = replace(STAGES["third"], optional_inputs=(), conditional_inputs=demands)
    skipped = make_pipeline({**STAGES, "third": third}).build("third").manifest.skipped
    assert "there is no frame campaign" in skipped
    assert skipped.endswith(
        "third needs it because of calibrate.damper: identified, calibrate.expected_amplitude_m: null"
    )


@pytest.mark.property
def test_optional_inputs_serve_together_so_one_that_lacks_spares_all(make_pipeline: MakePipeline) -> None:
    stages = {**STAGES, "third": replace(STAGES["third"], optional_inputs=("second", "campaign:frame"))}
    assert make_pipeline(stages).build("third").what == "skipped"
    assert CALLS == ["third"]


@pytest.mark.property
def test_beside_a_given_campaign_nothing_is_built_for_optional_inputs_that_would_have_to_be_recorded(
    make_pipeline: MakePipeline,
) -> None:
    recorder = replace(STAGES["first"], name="record-frame", outputs=("frame",))
    third = replace(STAGES["third"], optional_inputs=("second", "campaign:frame"))
    pipeline = make_pipeline(
        {**STAGES, "record-frame": recorder, "third": third},
        campaigns={"bench": None, "frame": "laboratory", "closed_loop": None},
    )
    pipeline.campaign_given = True
    assert pipeline.build("third").what == "skipped"
    assert CALLS == ["third"]


@pytest.mark.property
def test_undeclared_setting_is_refused(make_pipeline: MakePipeline) -> None:
    def run(context: StageContext) -> Mapping[str, Any]:
        return {"order": context.settings.prepare.order}

    with pytest.raises(LookupError, match=r"first reads prepare\.order but does not declare it"):
        make_pipeline(with_run("first", run)).build("first")


@pytest.mark.property
def test_failure_leaves_the_old_artifact_and_no_rubbish(make_pipeline: MakePipeline) -> None:
    pipeline = make_pipeline()
    pipeline.build("first")
    before = digest_of_artifact(pipeline.run_directory / "first.h5")

    def run(context: StageContext) -> Mapping[str, Any]:
        with context.write("first.h5") as artifact:
            artifact.put("values", [1.0], unit="m", dims=("time",))
            raise KeyboardInterrupt

    broken = make_pipeline(with_run("first", run), seed=3)
    with pytest.raises(KeyboardInterrupt):
        broken.build("first")
    assert digest_of_artifact(pipeline.run_directory / "first.h5") == before
    assert [path.name for path in pipeline.run_directory.iterdir() if path.name.endswith(".tmp")] == []
    assert make_pipeline(seed=3).build("first").what == "built"


@pytest.mark.property
def test_same_seed_gives_the_same_artifact_and_another_does_not(make_pipeline: MakePipeline, tmp_path: Path) -> None:
    digests = []
    for seed in (1, 1, 2):
        pipeline = make_pipeline(seed=seed)
        pipeline.force = frozenset(["first"])
        pipeline.build("first")
        digests.append(digest_of_artifact(tmp_path / "run" / "first.h5"))
    assert digests[0] == digests[1] != digests[2]


@pytest.mark.property
def test_artifact_carries_its_provenance(make_pipeline: MakePipeline) -> None:
    pipeline = make_pipeline()
    pipeline.build("second")
    root = Artifact(pipeline.run_directory / "second.h5").root
    assert {"schema", "stage", "mrpipe_version", "config", "inputs", "seed", "created_utc"} <= set(root)
    assert {"numpy_version", "scipy_version", "scikit-learn_version"} <= set(root)
    assert json.loads(root["inputs"]) == {"first.h5": sha256_of(pipeline.run_directory / "first.h5")}


@pytest.mark.property
def test_second_run_in_the_same_directory_is_refused(tmp_path: Path) -> None:
    import subprocess
    import sys

    code = (
        "import sys\nfrom pathlib import Path\nfrom mrpipe.pipeline.lock import run_lock\n"
        "from mrpipe.errors import UserError\n"
        "try:\n    with run_lock(Path(sys.argv[1])):\n        print('got it')\n"
        "except UserError as error:\n    print(error)\n"
    )
    command = [sys.executable, "-c", code, str(tmp_path)]
    with run_lock(tmp_path):
        answer = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        assert "is in use by process" in answer
        assert "--run" in answer
    assert "got it" in subprocess.run(command, capture_output=True, text=True, check=True).stdout


@pytest.mark.property
def test_broken_manifest_counts_as_none(tmp_path: Path) -> None:
    (tmp_path / "first.json").write_text('{"stage": "first"')
    assert Manifest.load(tmp_path, "first") is None


@pytest.mark.property
def test_json_is_strict() -> None:
    assert json.loads(to_json({"a": float("inf"), "b": (1, 2)})) == {"a": None, "b": [1, 2]}
    assert plain({"p": Path("x")}) == {"p": "x"}


@pytest.mark.property
def test_missing_artifact_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such artifact; run the stage that writes it"):
        Artifact(tmp_path / "none.h5")


@pytest.mark.property
@pytest.mark.parametrize("harm", ["remove", "change"])
def test_a_harmed_part_of_the_report_is_built_again(harm: str, make_pipeline: MakePipeline) -> None:
    pipeline = make_pipeline()
    pipeline.build("second")
    part = pipeline.run_directory / "report-parts" / "second.json"
    whole = part.read_text()
    if harm == "remove":
        part.unlink()
    else:
        part.write_text(whole[: len(whole) // 2])
    assert "damaged" in str(read_part(pipeline.run_directory, "second")) or harm == "remove"
    again = make_pipeline()
    assert again.build("second").what == "built"
    assert part.read_text() == whole
    assert CALLS == ["first", "second", "second"]


@pytest.mark.property
@pytest.mark.parametrize("content", ["", "null", "[]", '{"stage": 1}', '{"outputs": 5}'])
def test_a_damaged_manifest_counts_as_none(content: str, make_pipeline: MakePipeline) -> None:
    pipeline = make_pipeline()
    pipeline.build("first")
    path = pipeline.run_directory / "manifests" / "first.json"
    if content == '{"outputs": 5}':
        content = json.dumps({**json.loads(path.read_text()), "outputs": 5})
    path.write_text(content)
    again = make_pipeline()
    assert again.status(["first"])["first"] == ["never built"]
    assert again.build("first").what == "built"


@pytest.mark.property
def test_a_damaged_artifact_is_built_again(make_pipeline: MakePipeline) -> None:
    pipeline = make_pipeline()
    pipeline.build("second")
    path = pipeline.run_directory / "first.h5"
    before, content = digest_of_artifact(path), path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    again = make_pipeline()
    assert again.status(["second"])["first"] == ["output first.h5 was changed or damaged after it was written"]
    assert again.build("second").what == "reused"
    assert digest_of_artifact(path) == before


@pytest.mark.property
def test_a_directory_in_place_of_an_artifact_is_named(make_pipeline: MakePipeline) -> None:
    pipeline = make_pipeline()
    (pipeline.run_directory / "first.h5").mkdir(parents=True)
    pipeline.keep_going = True
    outcome = pipeline.build("first")
    assert outcome.what == "failed"
    assert outcome.manifest.skipped == f"failed: {pipeline.run_directory / 'first.h5'}: is a directory"
    assert not list(pipeline.run_directory.rglob("*.tmp"))


def _fails(context: StageContext) -> Mapping[str, Any]:
    CALLS.append("failing")
    raise UserError("data.csv", "row 3", "is not a number", "write a number")


@pytest.mark.property
def test_a_failure_leaves_out_only_what_depends_on_it(make_pipeline: MakePipeline) -> None:
    broken = replace(STAGES["first"], name="broken", run=_fails, outputs=("broken.h5",))
    needs = replace(STAGES["second"], name="needs", inputs=("broken",), outputs=("needs.h5",))
    likes = replace(STAGES["first"], name="likes", optional_inputs=("broken",), outputs=("likes.h5",))
    stages = {**STAGES, "broken": broken, "needs": needs, "likes": likes}
    pipeline = make_pipeline(stages)
    pipeline.keep_going = True
    what = {name: pipeline.build(name).what for name in ("broken", "needs", "likes", "second")}
    assert what == {"broken": "failed", "needs": "failed", "likes": "built", "second": "built"}
    assert CALLS.count("failing") == 1
    assert pipeline.outcomes["needs"].manifest.skipped == "not built, because broken failed"
    assert "row 3: is not a number" in pipeline.outcomes["broken"].manifest.skipped
    # later calls know it, and a stage command still ends with the error
    again = make_pipeline(stages)
    assert again.status(["needs"])["broken"][0].startswith("the last run of it failed: data.csv: row 3")
    with pytest.raises(UserError, match="row 3"):
        again.build("needs")
    mended = make_pipeline({**stages, "broken": replace(broken, run=STAGES["first"].run)})
    assert mended.build("likes").what == "built"


@pytest.mark.property
def test_a_stage_that_ran_without_an_optional_input_is_up_to_date(make_pipeline: MakePipeline) -> None:
    """After `close-loop --campaign`, `status` called it stale, because no frame had been identified."""
    alone = replace(STAGES["first"], name="alone", optional_inputs=("second", "campaign:frame"))
    stages = {"alone": alone, "second": replace(STAGES["second"], inputs=())}
    assert make_pipeline(stages).build("alone").what == "built"
    assert make_pipeline(stages).status(["alone"]) == {"alone": [], "second": ["never built"]}


@pytest.mark.property
def test_an_optional_input_that_fails_is_done_without(make_pipeline: MakePipeline) -> None:
    stages = with_run("second", _fails)
    pipeline = make_pipeline({**stages, "third": replace(STAGES["first"], optional_inputs=("second",))})
    assert pipeline.build("third").what == "built"
    assert pipeline.outcomes["second"].what == "failed"


@pytest.mark.property
def test_a_preferred_input_is_built_and_done_without_where_it_is_skipped_or_fails(make_pipeline: MakePipeline) -> None:
    # an optional input that lacks spares all optional ones; a preferred one is built all the same
    lacking = replace(STAGES["third"], name="wants", optional_inputs=("campaign:frame",))
    stages = {**STAGES, "wants": replace(lacking, preferred_inputs=("second",))}
    pipeline = make_pipeline(stages)
    assert pipeline.plan(["wants"]) == ["first", "second", "wants"]
    assert pipeline.waits_for("wants") == {"second"}
    assert pipeline.build("wants").what == "built"
    assert CALLS == ["first", "second", "third"]
    assert make_pipeline(stages).status(["wants"])["wants"] == []
    # what it reads is stale, so it is stale, and the reason names the stage
    changed = make_pipeline(stages, prepare={"cutoff_hz": 80.0}).status(["wants"])
    assert changed["wants"] == ["second, which it reads, is stale"]
    alone = replace(stages["wants"], run=STAGES["first"].run, settings=("prepare.cutoff_hz",), outputs=("first.h5",))
    for broken, cutoff_hz in ((_fails, 60.0), (_skips, 70.0)):
        without = {**stages, "second": replace(STAGES["second"], run=broken), "wants": alone}
        pipeline = make_pipeline(without, prepare={"cutoff_hz": cutoff_hz})
        assert pipeline.build("wants").what == "built"
        assert pipeline.outcomes["second"].what == ("failed" if broken is _fails else "skipped")


@pytest.mark.property
def test_wrong_settings_of_a_preferred_input_end_the_command(make_pipeline: MakePipeline) -> None:
    def check(settings: object) -> None:
        raise UserError("config.yaml", "form", "is not known", "name another one")

    stages = {**STAGES, "second": replace(STAGES["second"], check=check)}
    stages["third"] = replace(STAGES["third"], optional_inputs=(), preferred_inputs=("second",))
    with pytest.raises(UserError, match="is not known"):
        make_pipeline(stages).build("third")


def _skips(context: StageContext) -> Mapping[str, Any]:
    raise StageSkipped("no training test")


@pytest.mark.property
def test_a_full_disk_ends_the_run(make_pipeline: MakePipeline) -> None:
    import errno

    def run(context: StageContext) -> Mapping[str, Any]:
        raise OSError(errno.ENOSPC, "No space left on device")

    pipeline = make_pipeline(with_run("first", run))
    pipeline.keep_going = True
    with pytest.raises(OSError, match="No space left"):
        pipeline.build("first")


@pytest.mark.property
def test_a_part_that_fails_leaves_the_other_results(make_pipeline: MakePipeline) -> None:
    def run(context: StageContext) -> Mapping[str, Any]:
        context.fail("the closed loop", UserError("simulate", "amplitude", "is not found", "give one"))
        return STAGES["first"].run(context)

    outcome = make_pipeline(with_run("first", run)).build("first")
    assert outcome.what == "built"
    assert outcome.manifest.failed == "the closed loop failed: simulate: amplitude: is not found; give one"
    assert make_pipeline(with_run("first", run)).build("first").what == "reused"


@pytest.mark.property
def test_what_a_killed_process_left_is_removed_under_the_lock(tmp_path: Path) -> None:
    rubbish = [tmp_path / ".prepared.h5.123.tmp", tmp_path / "figures" / ".a.png.7.tmp"]
    folders = [tmp_path / ".bench.99.tmp", tmp_path / ".bench.99.old.tmp"]
    kept = [tmp_path / "notes.tmp", tmp_path / ".hidden.tmp", tmp_path / "manifests" / ".hashes.json"]
    for path in (*rubbish, *kept, *(folder / "data.csv" for folder in folders)):
        path.parent.mkdir(exist_ok=True)
        path.write_text("x")
    with run_lock(tmp_path):
        assert not any(path.exists() for path in (*rubbish, *folders))
        assert all(path.exists() for path in kept)
