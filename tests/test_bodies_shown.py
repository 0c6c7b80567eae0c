"""Bodies that give, as they are shown: tables, files, figures, reports, pictures, exports."""

from __future__ import annotations

import json

import mujoco
import numpy as np
import pandas as pd
import pytest
from builders import few
from PIL import Image

from trainmj.collision.body import yielded
from trainmj.collision.saved import load_result
from trainmj.collision.simulation import run
from trainmj.collision.summary import summarise
from trainmj.collision.wear import Wear, seen_at
from trainmj.errors import EngineError
from trainmj.scenario import Scenario, load
from trainmj.single import figures, tables
from trainmj.single.bodies import ALONG, along
from trainmj.single.folder import write_run
from trainmj.single.page import page_of_run
from trainmj.single.page_animation import animation_data
from trainmj.single.page_histories import _balance_lines
from trainmj.view import film, offscreen
from trainmj.view.scene import export, visible
from trainmj.view.shapes import Shapes, colour, largest_energy

TUBE = {"curve": {"stroke_mm": [0, 1, 2000], "force_kN": [0, 900, 900]}, "stiffness_kN_per_mm": 900, "beyond": "hold"}
BOGIES = {"mass_t": 4, "centres_m": 14}
HEAD = {"stiffness_kN_per_mm": 500, "collapse_force_kN": 400, "hardening_kN_per_mm": 0.5, "bogies": BOGIES}
VALUES = {
    "devices": {"tube": TUBE},
    "trains": {
        "train": {
            "vehicles": [
                {"name": "head", "body": {**HEAD, "attached_m": [6, 0]}},
                {"name": "tail", "body": {"frequency_Hz": 25, "members": 1}},
            ],
            "mass_t": 36,
            "length_m": 20,
            "front": "tube",
            "coupler": "tube",
            "brakes": {"force_kN": 40},
        }
    },
    "collision": {"train": "train", "speed_km_h": 36, "partner": "rigid_wall", "rail_friction": 0.01},
    "simulation": {"time_limit_s": 0.6, "step_ms": 0.05},
}


@pytest.fixture(scope="module")
def result():
    return run(Scenario.from_values(VALUES))


@pytest.fixture(scope="module")
def summary(result):
    return summarise(result)


@pytest.fixture(scope="module")
def folder(result, summary, tmp_path_factory):
    out = tmp_path_factory.mktemp("bodies")
    write_run(result, summary, out, formats=())
    return out


# tables and files


def test_a_body_has_a_row_and_what_has_yielded_stands_below_it(result, summary):
    """Breaks if a body, or a member that has yielded, is left out of the table, or a rigid one gets in."""
    table = tables.bodies(result.chain, summary)
    names = [row[0].strip() for row in table.rows]
    head = summary.vehicles[0]
    below = [m.name.removeprefix("M1 ") for m in head.members if abs(m.plastic_mm) > 0.05]
    assert names == ["M1", *below, "M2"]
    assert "member 2" in below, "attached 5 m from the end, the first member carries nothing"
    assert table.rows[0][1:4] == (head.body_shortening_mm, head.body_plastic_mm, head.body_plastic_5m_mm)
    assert sum(row[2] for row in table.rows[1:-1]) == pytest.approx(head.body_plastic_mm, abs=0.1)
    assert not {c.name for c in table.columns} & {
        c.name for t in tables.vehicles(result.chain, summary) for c in t.columns
    }


def test_of_many_members_a_few_are_told():
    """Breaks if a body of fifty members fills the screen, or the rest is not counted."""
    body = {**HEAD, "members": 30, "collapse_force_kN": 300}
    many = Scenario.from_values(VALUES).with_values({"trains.train.vehicles.0.body": body, "simulation.step_ms": 0.02})
    result = run(many)
    names = [row[0].strip() for row in tables.bodies(result.chain, summarise(result)).rows]
    assert len(names) <= 1 + 8 + 1 + 1
    assert any(name.endswith(" more") for name in names)


def test_the_input_says_what_each_body_is(result):
    """Breaks if check lists other frequencies, or another place of the devices, than are computed."""
    head, tail = tables.bodies_of(result.chain).rows
    own = 36e3 - 2 * 4e3
    bar = 0.5 * np.sqrt(500e6 / own)
    assert head[:3] == ("M1", 4, pytest.approx(500))
    assert head[3:5] == (pytest.approx(bar * 8 / np.pi * np.sin(np.pi / 8)), pytest.approx(bar))
    assert head[-2:] == ("5, 0", "2 x 4 t, 14 m, 500 kN/mm")
    assert tail[3:5] == (pytest.approx(25 * 2 / np.pi), pytest.approx(25))
    alike = tables.bodies_of(run(load("b_type", {"trains.b_type.body": HEAD, "simulation.time_limit_s": 0.01})).chain)
    assert [row[0] for row in alike.rows] == ["M1 to M6, S1 to S6"]


def test_energy_adds_up_with_bodies(result, summary):
    """Breaks if what bodies hold or lose is missing in the table, or counted twice."""
    values = {row[0].strip("\u00a0"): row[1] for row in tables.energy(summary).rows}
    start = values.pop("kinetic at the start")
    parts = {name: value for name, value in values.items() if not name.startswith("by ") or name in _RAILS}
    assert values["absorbed by the car bodies"] > 100
    assert sum(parts.values()) == pytest.approx(start, rel=1e-4)


_RAILS = ("by the rails", "by the brakes", "by the grade")


def test_the_picture_of_the_energy_has_the_bodies(result, summary):
    """Breaks if bodies are drawn as held in the devices, or brakes of a vehicle count once for each of its points."""
    lines = {trace["name"]: np.array(trace["y"]) for trace in _balance_lines(result, 1)}
    assert sum(lines.values()) == pytest.approx(summary.balance.kinetic_start_kJ, rel=1e-3)
    lost = yielded(result.chain.members, np.abs(result.tally.member_plastic)).sum() / 1e3
    assert lines["by yielding of car bodies"][-1] == pytest.approx(lost, rel=0.02)
    assert lost < sum(m.energy_kJ for v in summary.vehicles for m in v.members), "dashpots take the rest"
    assert lines["by the brakes"][-1] == pytest.approx(summary.balance.brakes_kJ, rel=0.02)


def test_a_file_has_every_member_and_point(result, summary, folder):
    """Breaks if a part is missing in bodies.csv, or stands at the wrong end of its body."""
    table = pd.read_csv(folder / "bodies.csv")
    head = table[table.vehicle == "M1"]
    assert head.part.tolist() == ["member"] * 4 + ["link"] * 2 + ["point"] * 5 + ["bogie"] * 2
    assert head.from_m.tolist() == [0, 5, 10, 15, 5, 15, 0, 5, 10, 15, 20, 3, 17]
    assert head.plastic_mm[:4].tolist() == pytest.approx([m.plastic_mm for m in summary.vehicles[0].members[:4]])
    assert head.peak_acceleration_g[6:].tolist() == pytest.approx(
        [p.peak_acceleration_g for p in summary.vehicles[0].points]
    )
    found = json.loads((folder / "summary.json").read_text())["vehicles"][0]
    assert [m["name"] for m in found["members"]] == head.name[:6].tolist()


def test_histories_have_each_body_as_a_whole(result, summary, folder):
    """Breaks if a table over time leaves bodies out, or has a column for each of their members."""
    table = pd.read_csv(folder / "histories.csv")
    assert [c for c in table if "member" in c or "point" in c] == []
    assert table.body_plastic_M1_mm.iloc[-1] == pytest.approx(summary.vehicles[0].body_plastic_mm, rel=1e-6)
    assert table.body_shortening_M2_mm.max() == pytest.approx(summary.vehicles[1].body_shortening_mm, rel=0.02)
    again = load_result(folder)
    assert np.array_equal(again.member_yielded, result.member_yielded)


def test_without_bodies_nothing_is_added(standard_result, tmp_path):
    """Breaks if a run of rigid vehicles leaves files, columns or tables of bodies."""
    write_run(standard_result, summarise(standard_result), tmp_path)
    assert not [p.name for p in (tmp_path).iterdir() if "bodies" in p.name]
    assert not [name for name in standard_result.table() if "body" in name]
    assert animation_data(standard_result)["bodies"] == [[]] * 12


# figures and report


def test_lines_along_a_body_begin_at_the_impact(result, summary):
    """Breaks if what is drawn along a body is turned round, or is not by the length of its members."""
    shortening, _, peaks = (along(result, one)["M1"] for one in ALONG)
    head = summary.vehicles[0]
    assert shortening[1][:4] == pytest.approx([m.shortening_mm / 5 for m in head.members[:4]])
    assert peaks[1] == pytest.approx([p.peak_acceleration_g for p in head.points[:5]])
    assert peaks[0].tolist() == [0, 5, 10, 15, 20]


def test_the_figure_leaves_out_what_has_not_happened(result):
    """Breaks if a panel of plastic shortening is drawn where nothing has yielded, or none where something has."""
    elastic = run(load("b_type_wall", {"trains.b_type.body": {"stiffness_kN_per_mm": 500}}))
    assert len(figures.bodies(result).axes) == 4
    titles = [axes.get_title(loc="left") for axes in figures.bodies(elastic).axes if axes.get_title(loc="left")]
    assert len(titles) == 3
    assert not any("Plastic" in title for title in titles)


def test_the_report_shows_bodies(result, summary, folder):
    """Breaks if the report has no table or plot of bodies."""
    html = page_of_run(result, summary, folder / "result.nc").html()
    for words in ("Bodies that give", "Plastic shortening along the body", "by yielding of car bodies"):
        assert words in html


def test_the_animation_has_members_that_shorten(result):
    """Breaks if the animation squeezes the wrong members, or colours what has not yielded."""
    data = animation_data(result)
    tail, head = data["bodies"]
    assert [member["stroke"][-1] > 10 for member in head[::-1]][:2] == [False, True], "from left to right"
    lost = result.member_yielded[-1] / 1e3
    inner = [k for k, m in enumerate(result.chain.members) if m.vehicle == 1 and m.span]
    assert [member["energy"][-1] for member in head] == pytest.approx(
        [lost[k] if abs(result.member_plastic[-1, k]) > 1e-3 else 0.0 for k in inner], rel=1e-3
    )
    assert all(not any(member["energy"]) for member in tail)
    assert data["largest_energy"] >= max(lost)


# pictures


def _worn(result):
    wear = Wear(result.chain)
    for sample in range(len(result.time)):
        wear.update(seen_at(result, sample))
    return wear


def _ends(model, data, name):
    """From where to where a mesh reaches along the track."""
    geom = model.geom(name).id
    mesh = model.geom_dataid[geom]
    corners = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
    x = corners @ data.geom_xmat[geom].reshape(3, 3)[0] + data.geom_xpos[geom, 0]
    return x.min(), x.max()


def test_pieces_of_a_car_reach_from_point_to_point(result):
    """Breaks if the shape of a member is not as short as the member, or a bogie or a device is not with its point."""
    chain, full = result.chain, largest_energy(result)
    model = visible(chain).compile()
    data = mujoco.MjData(model)
    wear, shapes = _worn(result), Shapes(model, chain, full)
    assert shapes.show(wear)
    data.qpos[:] = result.point_position[-1]
    mujoco.mj_kinematics(model, data)
    for number in (2, 3):  # those in the middle have no room for devices
        k = next(k for k, m in enumerate(chain.members) if m.name == f"M1 member {number}")
        member = chain.members[k]
        reach = _ends(model, data, f"M1 member {number} skin")
        points = [data.body(chain.points[p].name).xpos[0] for p in (member.left, member.right)]
        assert reach == pytest.approx(points, abs=2e-3)
        share = result.member_yielded[-1, k] / full
        assert model.geom_rgba[model.geom(f"M1 member {number} skin").id, :3] == pytest.approx(colour(share), abs=1e-6)
    assert 5 - np.ptp(_ends(model, data, "M1 member 2 skin")) == pytest.approx(
        summarise(result).vehicles[0].members[1].plastic_mm / 1e3, abs=5e-3
    )
    assert model.geom("M2 member 1 skin").matid[0] >= 0, "what is elastic keeps its own look"
    bogie = model.geom("M1 bogie right")
    assert model.body(bogie.bodyid[0]).name == "M1 bogie 1"
    coupler = model.geom("M1 front coupler tube")
    assert model.body(coupler.bodyid[0]).name == "M1 2"
    assert "M1 front draw bar" in [model.geom(g).name for g in range(model.ngeom)]
    assert shapes.show(wear) == [], "nothing has moved since"


def test_wear_of_bodies_is_that_of_the_result(result):
    """Breaks if a film shows other energies than the report."""
    assert _worn(result).yielded == pytest.approx(result.member_yielded[-1])


@pytest.mark.parametrize("camera", few(["overview", "follow"], 1))
def test_crushed_bodies_are_drawn_in_colour(result, tmp_path, camera):
    """Breaks if a body that has collapsed looks as before."""
    try:
        offscreen.check_platform()
    except EngineError as error:
        pytest.skip(str(error))
    seen = []
    for at in (0.0, float(result.time[-1])):
        film.render(result, tmp_path / "a.png", camera, size=(480, 270), at=at, smooth=False)
        r, _, b = np.moveaxis(np.asarray(Image.open(tmp_path / "a.png").convert("RGB"), dtype=int), 2, 0)
        seen.append(int(((r > 120) & (b < 0.65 * r))[60:210].sum()))
    assert seen[1] > seen[0] + 300


# export


def test_an_export_shortens_as_the_real_run_does():
    """Breaks if stand-ins of members are missing, too soft, or never yield."""
    plain = Scenario.from_values(VALUES).with_values(
        {
            "trains.train.vehicles.0.body": {**HEAD, "hardening_kN_per_mm": 0, "damping_ratio": 0},
            "trains.train.brakes": None,
            "collision.rail_friction": 0,
        }
    )
    result = run(plain)
    model = mujoco.MjModel.from_xml_string(export(result.chain))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    most = np.zeros(model.ntendon)
    for _ in range(round(result.time[-1] / model.opt.timestep)):
        mujoco.mj_step(model, data)
        most = np.maximum(most, data.ten_length)
    found = [most[model.tendon(m.name).id] for m in result.chain.members]
    strokes = [most[model.tendon(i.name).id] for i in result.chain.interfaces]
    assert max(result.tally.member_plastic) > 0.1
    assert found == pytest.approx(result.tally.member_stroke_max, rel=0.03, abs=3e-3)
    assert strokes == pytest.approx(result.tally.stroke_max, rel=0.02, abs=1e-4)


def test_an_export_says_what_its_members_do_not_do(result):
    """Breaks if someone takes a stand-in for the body itself."""
    words = " ".join(export(result.chain).split("-->")[0].split())
    assert "that members of car bodies harden as they yield" in words
    assert "M1, 4 members: 2000 kN/mm each, yields at 400 kN" in words
    assert "M1, 2 bogies: 500 kN/mm each" in words
