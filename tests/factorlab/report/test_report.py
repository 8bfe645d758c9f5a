"""The page stands alone, says what the JSON says, and appears whole or not at all."""

import dataclasses
import json
import re
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from evo.tools import file_interface

import sequential as sq
from factorlab.compare import compare, document
from factorlab.report import write_report
from factorlab.report.folder import OutputExistsError, require_free, whole_folder
from factorlab.report.style import LINES
from factorlab.report.tum import trajectory_of


@pytest.fixture
def written(walker, tmp_path):
    tables = (compare(walker, ("ekf", "iekf", "ekf_rts", "ieks"), tune=True),)
    page = write_report(tables, document(tables, "factorlab compare <walk> & run"), tmp_path / "out")
    return tables[0], page


def test_the_page_needs_no_network(written):
    html = written[1].read_text(encoding="utf-8")
    assert not re.findall(r"""(?:src|href|action|poster|data)\s*=\s*["']?\s*(?:https?:)?//""", html)
    assert not re.findall(r"url\(\s*[\"']?(?!#)", html)
    assert "@import" not in html
    assert "<script" not in html


def test_the_page_is_small_and_well_formed(written):
    html = written[1].read_text(encoding="utf-8")
    assert len(html.encode()) < 3_000_000
    figures = re.findall(r"<svg.*?</svg>", html, re.DOTALL)
    assert len(figures) == 8
    for svg in figures:
        ET.fromstring(svg)  # noqa: S314 - made here, a moment ago
    ids = re.findall(r'\bid="([^"]+)"', html)
    assert len(ids) == len(set(ids)), "ids of different figures do not meet"
    used = set(re.findall(r"url\(#([^)]+)\)", html)) | set(re.findall(r'href="#([^"]+)"', html))
    assert used <= set(ids)


def test_the_verdict_comes_first_and_text_is_escaped(written):
    table, page = written
    html = page.read_text(encoding="utf-8")
    assert html.index("Verdict") < html.index("Estimators, noise as shipped") < html.index("<svg")
    assert html.index("noise as shipped") < html.index("noise tuned on")
    assert "a walk &lt;in&gt; the park &amp; back" in html
    assert "factorlab compare &lt;walk&gt; &amp; run" in html
    for finding in table.findings:
        assert f'class="badge {finding.status}"' in html


def test_the_json_holds_the_same_numbers(written):
    table, page = written
    whole = json.loads((page.parent / "report.json").read_text(encoding="utf-8"))
    assert whole["estimators"]["ekf"]["rmse_m"] == table.rows[0].rmse
    on_disk = sorted(str(p.relative_to(page.parent)) for p in page.parent.rglob("*") if p.is_file())
    assert sorted(whole["files"]) == on_disk


def test_evo_reads_the_trajectories(written):
    table, page = written
    for row in table.rows:
        read = file_interface.read_tum_trajectory_file(page.parent / "trajectories" / f"{row.name}.tum")
        assert read.check()[0]
        np.testing.assert_allclose(read.positions_xyz[:, :2], row.run.mean[:, :2], rtol=0, atol=1e-9)
        np.testing.assert_allclose(read.timestamps, row.run.t * 1e-9)


def test_a_planar_heading_becomes_a_turn_about_z(walker):
    prior = sq.Gaussian([1.0, 2.0, 0.5], [1.0, 1.0, 1.0])
    model = sq.StateSpace(sq.SE2(), prior, sq.RandomWalk(0.1), {"gps": sq.Position(0.04, axes=2)})
    run = sq.run(sq.ExtendedKalmanFilter(), model, walker.log)
    made = trajectory_of(dataclasses.replace(walker, model=model), run)
    np.testing.assert_allclose(2 * np.arctan2(made.quaternion[:, 3], made.quaternion[:, 0]), run.mean[:, 2])
    np.testing.assert_array_equal(made.quaternion[:, 1:3], 0.0)
    np.testing.assert_array_equal(made.position[:, 2], 0.0)


def test_every_estimator_has_a_look_of_its_own():
    assert len({look["color"] + look["linestyle"] for look in LINES.values()}) == len(LINES)
    assert len({look["marker"] for look in LINES.values()}) == len(LINES)


def test_a_state_without_a_position_still_gets_its_page(walker, tmp_path):
    model = sq.StateSpace(
        sq.Vector(2),
        sq.Gaussian([0.0, 0.0], [1.0, 1.0]),
        sq.RandomWalk(0.1),
        {"a": sq.LinearSensor([[1.0, 0.0]], 1.0)},
    )
    log = sq.SensorLog({"a": sq.Stream(np.arange(40) * 0.1, np.sin(np.arange(40)))})
    swing = dataclasses.replace(walker, model=model, log=log, truth=None, knobs=())
    tables = (compare(swing, ("ekf", "ieks")), compare(swing, ("ekf",)))
    page = write_report(tables, document(tables, "test"), tmp_path / "out")
    assert "<svg" in page.read_text(encoding="utf-8")
    assert not (page.parent / "trajectories").exists()


def test_a_failure_leaves_nothing_behind(tmp_path):
    def write_half():
        with whole_folder(tmp_path / "out", force=False) as folder:
            (folder / "report.html").write_text("half", encoding="utf-8")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write_half()
    assert not list(tmp_path.iterdir())


def test_force_takes_away_an_earlier_report_and_nothing_else(tmp_path):
    out = tmp_path / "deep" / "out"

    def write(*names, force):
        with whole_folder(out, force=force) as folder:
            for name in names:
                (folder / name).parent.mkdir(exist_ok=True)
                (folder / name).write_text(name, encoding="utf-8")
            (folder / "report.json").write_text(
                json.dumps({"files": [*names, "report.json"]}), encoding="utf-8"
            )

    write("trajectories/ekf.tum", "other/ukf.tum", force=False)
    (out / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(OutputExistsError, match="--force"):
        write("trajectories/ekf.tum", force=False)
    write("trajectories/ekf.tum", force=True)
    kept = {str(p.relative_to(out)) for p in out.rglob("*") if p.is_file()}
    assert kept == {"notes.txt", "report.json", "trajectories/ekf.tum"}
    assert not (out / "other").exists()


def test_a_manifest_cannot_reach_outside(tmp_path):
    (tmp_path / "precious.txt").write_text("mine", encoding="utf-8")
    out = tmp_path / "out"
    out.mkdir()
    (out / "report.json").write_text(json.dumps({"files": ["../precious.txt", 3]}), encoding="utf-8")
    with whole_folder(out, force=True) as folder:
        (folder / "report.json").write_text("{}", encoding="utf-8")
    assert (tmp_path / "precious.txt").exists()


def test_a_file_is_no_folder(tmp_path):
    (tmp_path / "taken").write_text("", encoding="utf-8")
    for target in (tmp_path / "taken", tmp_path / "taken" / "deeper"):
        with pytest.raises(OutputExistsError, match="is a file"):
            require_free(target, force=True)
