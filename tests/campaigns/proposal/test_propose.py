"""A folder of files becomes a campaign: channels, units, roles and kinds, and what is unsure is said."""

from __future__ import annotations

from pathlib import Path

import h5py
import nptdms
import numpy as np
import pytest
import yaml
from asammdf import MDF, Signal
from scipy.io import savemat

from mrpipe.campaigns import load_campaign
from mrpipe.campaigns.plausibility import judge
from mrpipe.campaigns.proposal import Proposal, propose_campaigns
from mrpipe.campaigns.proposal.kinds import GAINS, law_of
from mrpipe.campaigns.proposal.roles import propose_frame_roles
from mrpipe.campaigns.proposal.words import read_header, read_path
from mrpipe.cli.project import lay_out
from mrpipe.control.laws import law_named
from mrpipe.errors import UserError
from tests.campaigns.plausibility.rig import sound_tests
from tests.campaigns.proposal.rigs import bench_folder, frame_folder

HEADERS = [
    ("Kraft (kN)", "force", "kN"),
    ("Weg [mm]", "displacement", "mm"),
    ("Strom", "current", ""),
    ("Force", "force", ""),
    ("Disp", "displacement", ""),
    ("a_1", "acceleration", ""),
    ("Disp, LVDT (mm)", "displacement", "mm"),
    ("Load Cell (lbf)", "force", "lbf"),
    ("Fuerza [N]", "force", "N"),
    ("Desplazamiento/mm", "displacement", "mm"),
    ("Déplacement (mm)", "displacement", "mm"),
    ("Accélération_m/s^2", "acceleration", "m/s^2"),
    ("Spulenstrom in mA", "current", "mA"),
    ("Tensione [V]", "voltage", "V"),
    ("U [V]", "voltage", "V"),
    ("u (mm)", "displacement", "mm"),
    ("Temps (s)", "time", "s"),
    ("Time, rel (ms)", "time", "ms"),
    ("F_N", "force", "N"),
    ("forceDamper [N]", "force", "N"),
    ("Dämpferkraft (N)", "force", "N"),
    ("Prędkość [m/s]", "velocity", "m/s"),
    ("Kanal 7", "", ""),
    ("Temperature (degC)", "", ""),
]


@pytest.mark.golden
@pytest.mark.parametrize(("text", "quantity", "unit"), HEADERS)
def test_headers_of_many_languages(text: str, quantity: str, unit: str) -> None:
    header = read_header(text)
    assert (header.quantity, header.unit) == (quantity, unit)


@pytest.mark.golden
def test_floors_and_commands_in_headers() -> None:
    floors = ("Etage 2 (g)", "accFloor3 [m/s2]", "Tisch (g)", "a_g", "Roof acc", "piso 1 (cm/s2)")
    assert [read_header(text).floor for text in floors] == [2, 3, 0, 0, -1, 1]
    assert read_header("Force command (N)").command and not read_header("Force (N)").command


def _proposed(folder: Path, beside: Path, rig: str | None = None) -> tuple[Proposal, Path]:
    (proposal,) = propose_campaigns(folder, "own", rig, beside)  # type: ignore[arg-type]
    beside.mkdir(parents=True)
    (beside / "campaign.yaml").write_text(proposal.text, encoding="utf-8")
    return proposal, beside


def _write_with_units(folder: Path, ending: str) -> None:
    """Write two tests whose files state mm and kN next to the names of the channels."""
    folder.mkdir()
    for index, test in enumerate(sound_tests(2, seed=1)):
        time, path = test.time_s, folder / f"t{index}{ending}"
        stated = {"Displacement": (1e3 * test.displacement_m, "mm"), "Force": (1e-3 * test.force_n, "kN")}
        if ending == ".tdms":
            clock = {"wf_increment": float(time[1] - time[0]), "wf_start_offset": 0.0}
            with nptdms.TdmsWriter(str(path)) as writer:
                writer.write_segment(
                    [
                        nptdms.ChannelObject("rig", name, values, properties={**clock, "unit_string": unit})
                        for name, (values, unit) in stated.items()
                    ]
                )
        elif ending == ".mf4":
            file = MDF(version="4.10")
            file.append([Signal(values, time, name=name, unit=unit) for name, (values, unit) in stated.items()])
            file.save(path)
        else:
            with h5py.File(path, "w") as handle:
                handle["t"] = time
                for name, (values, unit) in stated.items():
                    handle[name] = values
                    handle[name].attrs["units"] = unit


@pytest.mark.planted
@pytest.mark.parametrize("ending", [".tdms", ".mf4", ".h5"])
def test_units_that_a_file_states_beside_the_names(tmp_path: Path, ending: str) -> None:
    """The unit was guessed from the amplitude, although the file states it: kN for a force of 200 became N."""
    _write_with_units(tmp_path / "m", ending)
    proposal, _ = _proposed(tmp_path / "m", tmp_path / "p" / "data" / "own")
    assert proposal.channels["displacement"].endswith("[mm]") and proposal.channels["force"].endswith("[kN]")
    assert not any("no unit" in line for line in proposal.unsure if "time" not in line)


@pytest.mark.planted
def test_groups_of_one_file_are_tests(tmp_path: Path) -> None:
    """Only the columns of the longest group were used, as if the file held one test."""
    (tmp_path / "m").mkdir()
    tests = sound_tests(4, seed=1)
    with h5py.File(tmp_path / "m" / "all.h5", "w") as handle:
        for index, test in enumerate(tests):
            group = handle.create_group(f"v_run{index}")
            count = test.time_s.size - 100 * index
            for name, values in (
                ("time_s", test.time_s),
                ("disp_mm", 1e3 * test.displacement_m),
                ("current_A", test.drive),
                ("force_N", test.force_n),
                ("temp", 20.0 + test.time_s),
            ):
                group[name] = values[:count]
    proposal, beside = _proposed(tmp_path / "m", tmp_path / "p" / "data" / "own")
    campaign = load_campaign(beside)
    assert [item.name for item in campaign.recordings] == [f"all-v_run{index}" for index in range(4)]
    assert "velocity" not in proposal.channels  # the v of the group had made one of the temperature
    assert any("4 groups" in line for line in proposal.unsure)
    for index, test in enumerate(campaign.recordings):
        np.testing.assert_allclose(test.channels["force"], tests[index].force_n[: test.time_s.size], atol=1e-9)


@pytest.mark.planted
def test_groups_of_a_waveform_file_have_their_own_clocks(tmp_path: Path) -> None:
    """The clock of the first channel was taken for all groups."""
    (tmp_path / "m").mkdir()
    tests = sound_tests(2, seed=1)
    with nptdms.TdmsWriter(str(tmp_path / "m" / "all.tdms")) as writer:
        for index, test in enumerate(tests):
            clock = {"wf_increment": (1 + index) * float(test.time_s[1] - test.time_s[0]), "wf_start_offset": 0.0}
            stated = {"Weg": (test.displacement_m, "m"), "Kraft": (test.force_n, "N"), "Strom": (test.drive, "A")}
            writer.write_segment(
                [
                    nptdms.ChannelObject(
                        f"run{index}", name, values[:: 1 + index], properties={**clock, "unit_string": unit}
                    )
                    for name, (values, unit) in stated.items()
                ]
            )
    _, beside = _proposed(tmp_path / "m", tmp_path / "p" / "data" / "own")
    rates = [item.sampling_rate_hz for item in load_campaign(beside).recordings]
    assert rates[0] == pytest.approx(2.0 * rates[1])


@pytest.mark.golden
@pytest.mark.parametrize(
    ("name", "quantity"),
    [
        ("v_rand/temp", ""),
        ("run1/F", "force"),
        ("Force/Value", "force"),
        ("Weg/mm", "displacement"),
        ("v1/I_A", "current"),
    ],
)
def test_the_channel_comes_before_its_group(name: str, quantity: str) -> None:
    assert read_path(name, "/").quantity == quantity


@pytest.mark.planted
@pytest.mark.parametrize("several", [True, False])
def test_a_single_drive_has_no_inverse_model(tmp_path: Path, several: bool) -> None:
    """`init` had listed train-inverse in any case, and the run that it proposes was refused."""
    (tmp_path / "m").mkdir()
    for index, test in enumerate(sound_tests(3, seed=1)):
        columns = [
            test.time_s,
            1e3 * test.displacement_m,
            test.force_n,
            *([0.0 * test.drive + index] if several else []),
        ]
        header = "t [s],x [mm],F [N]" + (",i [A]" if several else "")
        np.savetxt(
            tmp_path / "m" / f"t{index}.csv", np.column_stack(columns), delimiter=",", header=header, comments=""
        )
    project = lay_out(tmp_path / "p", source=tmp_path / "m")
    config = (tmp_path / "p" / "configs" / "p.yaml").read_text(encoding="utf-8")
    assert ("train-inverse, identify-damper" in config) is several
    assert project.proposals[0].drive_varies is several
    # one line for all tests, not one for each
    assert sum("0 A is a placeholder" in line for line in project.proposals[0].unsure) == (not several)


@pytest.mark.planted
def test_foreign_headers_decimal_commas_and_mixed_units(tmp_path: Path) -> None:
    proposal, beside = _proposed(bench_folder(tmp_path / "Messdaten"), tmp_path / "p" / "data" / "own")
    campaign = load_campaign(beside)
    assert proposal.rig == "bench" and campaign.drive_unit == "A" and len(campaign.recordings) == 8
    assert judge(campaign) == () and campaign.findings == ()
    assert campaign.with_role("training") and campaign.with_role("validation")
    for test, truth in zip(campaign.recordings, sound_tests(8, seed=1), strict=True):
        np.testing.assert_allclose(test.channels["displacement"], truth.displacement_m, atol=1e-8)
        np.testing.assert_allclose(test.channels["force"], truth.force_n, atol=2e-3)
        np.testing.assert_allclose(test.channels["drive"], truth.drive, atol=1e-6)


@pytest.mark.planted
def test_a_frame_is_recognised_with_floors_and_kinds(tmp_path: Path) -> None:
    proposal, beside = _proposed(frame_folder(tmp_path / "Turm", sweep_s=20.0), tmp_path / "p" / "data" / "own")
    campaign = load_campaign(beside)
    assert proposal.rig == "frame" and campaign.rig == "shear-frame"
    assert [(test.kind, test.details.get("mode")) for test in campaign.recordings] == [
        *[("free-decay", mode) for mode in (1, 2, 3)],
        *[("sweep", None)] * 2,
    ]
    assert "floor_acceleration_3" in campaign.recordings[0].channels
    assert any("floor_masses_kg" in line for line in proposal.unsure)


@pytest.mark.planted
def test_a_folder_with_bench_and_frame_becomes_two_campaigns(tmp_path: Path) -> None:
    bench_folder(tmp_path / "all" / "damper", 4, samples=400)
    frame_folder(tmp_path / "all" / "tower", sweep_s=5.0)
    found = propose_campaigns(tmp_path / "all", "own", "both", tmp_path / "p" / "data" / "own")
    assert [(item.rig, len(item.tests)) for item in found] == [("bench", 4), ("frame", 5)]


@pytest.mark.planted
def test_bench_tests_that_are_taken_for_tests_of_a_structure_are_doubted(tmp_path: Path) -> None:
    folder = bench_folder(tmp_path / "damper", 4, samples=400)
    [proposal] = propose_campaigns(folder, "own", "frame", tmp_path / "p" / "data" / "own")
    said = [line for line in proposal.unsure if "look like bench tests of a damper" in line]
    assert len(said) == 1 and said[0].startswith("4 tests (") and "in a new directory with --rig bench" in said[0]
    # nothing is demanded of tests that are not closed loops
    assert not any("control law" in line for line in proposal.unsure)
    marked = [line for line in proposal.text.splitlines() if "UNSURE: looks like a bench test of a damper" in line]
    assert len(marked) == 4


@pytest.mark.planted
def test_closed_loops_of_a_structure_are_no_bench_tests_and_share_their_question(tmp_path: Path) -> None:
    folder = tmp_path / "tower"
    folder.mkdir()
    rows = [f"{k / 100};{k % 7 - 3};{k % 5 - 2};{k % 3};{k % 4}" for k in range(400)]
    for name in ("messung_1", "messung_2"):
        lines = ["Zeit (s);Etage 1 (g);Etage 2 (g);Dämpferkraft (N);Strom (A)", *rows]
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    [proposal] = propose_campaigns(folder, "own", None, tmp_path / "p" / "data" / "own")
    assert [kind for _, kind in proposal.tests] == ["closed-loop", "closed-loop, validation"]
    assert not any("bench" in line for line in proposal.unsure)
    assert [line for line in proposal.unsure if "control law" in line] == [
        "2 tests (messung_1, messung_2): the control law is not known; write law: vd, or another one"
    ]


@pytest.mark.planted
def test_channels_that_some_files_lack_belong_to_the_tests_that_have_them(tmp_path: Path) -> None:
    folder = frame_folder(tmp_path / "Turm", sweep_s=20.0)
    header, *rows = (folder / "gleitsinus1.csv").read_text(encoding="utf-8").splitlines()
    for index in (1, 2):
        lines = [f"{header};Weg Etage 1 (mm);Kraft Dämpfer (N);Strom (A)"]
        lines += [f"{row};{index}{number % 7},5;1{number % 5},0;0,5" for number, row in enumerate(rows)]
        (folder / f"geregelt_vd_{index}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    proposal, beside = _proposed(folder, tmp_path / "p" / "data" / "own")
    tests = {test.name: test for test in load_campaign(beside).recordings}
    assert "floor_displacement_1" not in tests["gleitsinus1"].channels
    assert {"floor_displacement_1", "damper_force", "drive"} <= set(tests["geregelt_vd_1"].channels)
    assert (tests["geregelt_vd_1"].kind, tests["geregelt_vd_1"].details["law"]) == ("closed-loop", "vd")
    assert [name for name, test in tests.items() if test.role == "validation"] == ["geregelt_vd_2", "gleitsinus2"]
    assert any("gains of law vd are not known; write gains: {c_n_s_m: ...}" in line for line in proposal.unsure)
    # every open question is marked where it is to be answered
    marked = [line for line in proposal.text.splitlines() if "UNSURE" in line]
    assert any("geregelt_vd_1" in line for line in marked) and any("floor_masses_kg" in line for line in marked)
    bench, _ = _proposed(bench_folder(tmp_path / "bench", 4, samples=400), tmp_path / "q" / "data" / "own")
    roles = next(line.removeprefix("roles: ") for line in bench.unsure if line.startswith("roles: "))
    assert f"tests:   # UNSURE: {roles}" in bench.text.splitlines()


@pytest.mark.golden
def test_laws_in_the_names_of_files() -> None:
    names = {
        "boucle_passive_off": "passive-off",
        "passiv ein 2": "passive-on",
        "geregelt_fdns_1": "fdns",
        "essai_12": "",
        "passive": "",
    }
    assert {name: law_of(Path(f"{name}.csv")) for name in names} == names
    # the names of gains are those of the control laws
    assert all(law_named(law).gain_names == gains for law, gains in GAINS.items())


@pytest.mark.golden
def test_roles_of_a_frame_follow_names_and_repeated_kinds() -> None:
    paths = [Path(name) for name in ("sweep1.csv", "sweep2.csv", "noise.csv", "decay.csv")]
    kinds = ["sweep", "sweep", "random", "free-decay"]
    assert propose_frame_roles(paths, kinds) == ["training", "validation", "training", "training"]
    assert propose_frame_roles(paths[:1], kinds[:1]) == ["training"]
    named = [Path("sweep_valid.csv"), Path("sweep2.csv")]
    assert propose_frame_roles(named, ["sweep", "sweep"]) == ["validation", "training"]


@pytest.mark.planted
def test_files_without_headers_are_guessed_and_marked(tmp_path: Path) -> None:
    folder = tmp_path / "raw"
    folder.mkdir()
    for index, test in enumerate(sound_tests(4)):
        rows = np.column_stack([test.time_s, 1e3 * test.displacement_m, test.force_n])
        np.savetxt(folder / f"run{index}_{0.5 * index:g}A.csv", rows, delimiter=",", fmt="%.7g")
    proposal, beside = _proposed(folder, tmp_path / "p" / "data" / "own")
    campaign = load_campaign(beside)
    np.testing.assert_allclose(
        campaign.recordings[1].channels["displacement"], sound_tests(4)[1].displacement_m, atol=1e-8
    )
    assert [float(test.channels["drive"][0]) for test in campaign.recordings] == [0.0, 0.5, 1.0, 1.5]
    assert "UNSURE" in proposal.text and any("displacement" in line for line in proposal.unsure)


@pytest.mark.planted
def test_repeats_and_names_settle_roles(tmp_path: Path) -> None:
    folder = tmp_path / "raw"
    folder.mkdir()
    for index, test in enumerate([*sound_tests(4), *sound_tests(4, seed=9)]):
        rows = np.column_stack([test.time_s, test.displacement_m, test.drive, test.force_n])
        np.savetxt(folder / f"run{index}.csv", rows, delimiter=",", header="t,x (m),i (A),F (N)", comments="")
    (proposal,) = propose_campaigns(folder, "own", None, tmp_path / "p")
    assert [role for _, role in proposal.tests] == ["training"] * 4 + ["validation"] * 4
    for path in sorted(folder.glob("*.csv"))[:2]:
        path.rename(folder / f"valid_{path.name}")
    (proposal,) = propose_campaigns(folder, "own", None, tmp_path / "p")
    assert [name for name, role in proposal.tests if role == "validation"] == ["valid_run0", "valid_run1"]


@pytest.mark.planted
def test_one_file_is_split_into_training_and_validation(tmp_path: Path) -> None:
    folder = tmp_path / "raw"
    folder.mkdir()
    test = sound_tests(2)[1]
    rows = np.column_stack([test.time_s, test.displacement_m, test.drive, test.force_n])
    np.savetxt(folder / "one.csv", rows, delimiter=",", header="t,x (m),i (A),F (N)", comments="")
    _, beside = _proposed(folder, tmp_path / "p" / "data" / "own")
    campaign = load_campaign(beside)
    assert [test.role for test in campaign.recordings] == ["training", "validation"]
    assert not {item.name for item in judge(campaign)} & {"same-record"}


@pytest.mark.property
@pytest.mark.parametrize("name", ["a'b", 'a"b', "a: b", "- a", "#a", "null", "1e3", "Größe ä", "{x}", "a\\b"])
def test_awkward_file_names_and_headers_give_valid_yaml(tmp_path: Path, name: str) -> None:
    folder = tmp_path / name
    folder.mkdir()
    test = sound_tests(2)[1]
    rows = np.column_stack([test.time_s, test.displacement_m, test.drive, test.force_n])
    header = f'"t {name.replace(chr(34), "")}",x (m),i (A),F (N)'
    for index in (1, 2):
        np.savetxt(folder / f"{name}{index}.csv", rows, delimiter=",", header=header, comments="")
    (proposal,) = propose_campaigns(folder, name, None, tmp_path / "p")
    content = yaml.safe_load(proposal.text)
    assert content["campaign"] == name and content["tests"][0]["file"] == f"{name}1.csv"


@pytest.mark.golden
def test_a_folder_that_holds_nothing_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("only words\n")
    with pytest.raises(UserError, match="holds no readable data file"):
        propose_campaigns(tmp_path, "own", None, tmp_path / "p")


def _write_bench(folder: Path, tests: dict[str, tuple[float, float, float]], tail: str = "") -> Path:
    """Write a file per test: name -> amplitudes of displacement and force, and the drive. Headers name no units."""
    folder.mkdir()
    time = np.arange(3000) / 500.0
    for name, (travel, force, drive) in tests.items():
        wave = np.sin(2.0 * np.pi * time)
        rows = np.column_stack([time, travel * wave, np.full(time.size, drive), force * np.cos(2.0 * np.pi * time)])
        text = "\n".join(",".join(f"{value:.6f}" for value in row) for row in rows)
        (folder / name).write_text(f"time,displacement,current,force\n{text}\n{tail}")
    return folder


@pytest.mark.planted
def test_columns_without_units_have_one_unit_in_all_files(tmp_path: Path) -> None:
    sizes = {
        "a.csv": (0.1, 4.0, 0.0),
        "b.csv": (8.0, 90.0, 20.0),
        "c.csv": (8.0, 170.0, 80.0),
        "d.csv": (6.0, 95.0, 20.0),
    }
    found, path = _proposed(_write_bench(tmp_path / "raw", sizes), tmp_path / "beside")
    assert {key: text.split()[-1] for key, text in found.channels.items()} == {
        "time": "[s]",
        "displacement": "[mm]",
        "drive": "[mA]",
        "force": "[N]",
    }
    read = load_campaign(path)
    assert [float(np.ptp(test.channels["displacement"])) for test in read.recordings] == pytest.approx(
        [2e-4, 16e-3, 16e-3, 12e-3], rel=1e-3
    )
    assert [float(test.channels["drive"][0]) for test in read.recordings] == pytest.approx([0.0, 0.02, 0.08, 0.02])


@pytest.mark.planted
def test_a_clock_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    sizes = {"a.csv": (5.0, 90.0, 1.0), "b.csv": (8.0, 170.0, 2.0)}
    found, _ = _proposed(_write_bench(tmp_path / "raw", sizes, tail="End of test\n"), tmp_path / "beside")
    expected = (
        "column time is not used: a.csv: line 3002, column time: 'End of test' is not a number; delete the lines after "
        "the last sample (and in 1 other file)"
    )
    assert expected in found.unsure


@pytest.mark.planted
def test_a_changing_current_without_a_header_is_no_displacement(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    time = np.arange(6000) / 500.0
    # a random motion of 0.5 to 5 Hz, and a current that changes more slowly than the motion
    motion = sum(
        np.sin(2.0 * np.pi * f * time + p) / f for f, p in zip(np.linspace(0.5, 5.0, 19), range(19), strict=True)
    )
    velocity = np.gradient(motion, 1.0 / 500.0)
    current = np.interp(time, np.arange(0.0, 12.5, 0.5), rng.choice([0.0, 0.5, 1.0, 1.5, 2.0], 25))
    force = (60.0 + 400.0 * current) * np.tanh(velocity / 3.0) + 20.0 * velocity
    folder = tmp_path / "raw"
    folder.mkdir()
    table = np.column_stack([time, motion + rng.normal(0.0, 1e-3, time.size), current, force])
    savemat(folder / "a.mat", {"M": table})
    proposal, _ = _proposed(folder, tmp_path / "beside")
    assert proposal.channels["displacement"].startswith("M[:,1]")
    assert proposal.channels["drive"].startswith("M[:,2]")
    assert proposal.channels["force"].startswith("M[:,3]")
    # one record is divided, and no part ends after it
    assert "[7.79870000" not in proposal.text and ", 11.998]]" in proposal.text


@pytest.mark.planted
def test_guesses_of_single_tests_and_doubled_headers_are_in_the_summary(tmp_path: Path) -> None:
    folder = tmp_path / "raw"
    folder.mkdir()
    time = np.arange(3000) / 500.0
    motion, force = 5.0 * np.sin(6.0 * time), 90.0 * np.tanh(9.0 * np.cos(6.0 * time))
    for name, header, more in (("a", "t [s],x [mm],F [N],F [N]", 0.1 * force), ("b", "t [s],x [mm],F [N],acc", force)):
        rows = np.column_stack([time, motion, force, more])
        text = "\n".join(",".join(f"{value:.6f}" for value in row) for row in rows)
        (folder / f"{name}.csv").write_text(f"{header}\n{text}\n")
    found, _ = _proposed(folder, tmp_path / "beside")
    assert any("acceleration of 1 test (b), column acc: no unit in the header" in line for line in found.unsure)
    assert any("the header is that of 2 columns; the other is F [N]#3" in line for line in found.unsure)


@pytest.mark.golden
def test_a_file_of_two_rows_is_called_that(tmp_path: Path) -> None:
    folder = bench_folder(tmp_path / "raw", 2)
    (folder / "short.csv").write_text("t;x\n0,0;0,1\n1,0;0,2\n")
    found, _ = _proposed(folder, tmp_path / "beside")
    assert any(line.startswith("short.csv: has 2 rows only") for line in found.skipped)


@pytest.mark.planted
@pytest.mark.parametrize(("travel", "drive_unit"), [("x [mm]", "V"), ("u [mm]", "A")])
def test_the_letter_u_is_a_voltage_where_another_column_is_the_displacement(
    tmp_path: Path, travel: str, drive_unit: str
) -> None:
    folder = tmp_path / "raw"
    folder.mkdir()
    drive = "u" if drive_unit == "V" else "i [A]"
    for index, test in enumerate(sound_tests(4, seed=1)):
        rows = np.column_stack([test.time_s, 1e3 * test.displacement_m, test.drive, test.force_n])[:2000]
        header = f"t [s],{travel},{drive},F [N]"
        np.savetxt(folder / f"t{index}.csv", rows, delimiter=",", header=header, comments="", fmt="%.6f")
    _, beside = _proposed(folder, tmp_path / "own")
    channels = yaml.safe_load((beside / "campaign.yaml").read_text(encoding="utf-8"))["channels"]
    assert (channels["drive"]["column"], channels["drive"]["unit"]) == (drive, drive_unit)
    assert channels["displacement"]["column"] == travel
