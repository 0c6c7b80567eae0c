"""Saved results: what is written is what is read, and what cannot be is said."""

from __future__ import annotations

import tracemalloc
import warnings
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from builders import by_xarray, changed, scenario, values
from scipy.io import netcdf_file

from trainmj.collision.block import TALLY
from trainmj.collision.fields import KEPT
from trainmj.collision.result import Result
from trainmj.collision.saved import load_result
from trainmj.collision.simulation import run
from trainmj.collision.summary import summarise
from trainmj.errors import InputError, OutputError
from trainmj.files.commas import as_csv, columns_of
from trainmj.files.netcdf import unpacked
from trainmj.files.signed import signed
from trainmj.output.style import encode, styled
from trainmj.scenario import Scenario, load, to_yaml
from trainmj.single.figures import collision
from trainmj.single.folder import tables_of, write_run


@pytest.fixture(scope="module")
def saved(standard_result, tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("results") / "result.nc"
    standard_result.save(file)
    return file


@pytest.fixture(scope="module")
def short_result() -> Result:
    return run(load("b_type_wall", {"simulation.time_limit_s": 0.02}))


TITLES = {"title": "Zug, „ü“ und Ω"}
BENT = TITLES | {"trains.b_type.body": {"stiffness_kN_per_mm": 1000, "members": 2}}


@pytest.mark.parametrize(
    ("name", "changes"), [("b_type", BENT), ("b_type_vertical", {"title": "x"}), ("b_type_wall", TITLES)]
)
def test_files_have_the_bytes_that_xarray_and_pandas_would_write(tmp_path, name, changes):
    """Breaks if other programs would read something else in them."""
    result = run(load(name, changes | {"simulation.time_limit_s": 0.03}))
    summary = summarise(result)
    write_run(result, summary, tmp_path, formats=())
    assert (tmp_path / "result.nc").read_bytes() == by_xarray(result.dataset())
    tables = tables_of(result, summary)
    assert {f"{name}.csv" for name in tables} == {file.name for file in tmp_path.glob("*.csv")}
    for table, frame in tables.items():
        assert (tmp_path / f"{table}.csv").read_bytes() == frame.to_csv(index=False, float_format="%.9g").encode()


def test_so_have_tables_with_every_kind_of_cell():
    rows = [
        {"a": 1, "b": 1.5, "c": None, "d": "x, y", "e": True, "f": 2, "g": 'say "so"'},
        {"a": -20, "b": float("nan"), "c": None, "d": "", "e": False, "f": None, "h": 1e300},
        {"b": np.float64(1 / 3), "e": True, "f": 123456789012, "g": "two\nlines", "a": 3, "d": None},
    ]
    assert as_csv(columns_of(rows), "%.9g") == pd.DataFrame(rows).to_csv(index=False, float_format="%.9g")
    assert as_csv({"time": np.arange(3) / 7, "n": np.arange(3)}, "%.3g") == pd.DataFrame(
        {"time": np.arange(3) / 7, "n": np.arange(3)}
    ).to_csv(index=False, float_format="%.3g")


def test_a_saved_result_is_read_back_exactly(standard_result, saved):
    read = load_result(saved)
    for f in fields(Result):
        ours, theirs = getattr(standard_result, f.name), getattr(read, f.name)
        if isinstance(ours, np.ndarray):
            assert np.array_equal(ours, theirs), f.name
            assert ours.dtype == theirs.dtype, f.name
    for f in TALLY:
        ours, theirs = getattr(standard_result.tally, f.name), getattr(read.tally, f.name)
        assert np.array_equal(ours, theirs), f.name
        assert type(ours) is type(theirs), f.name
    assert read.versions == standard_result.versions
    assert to_yaml(read.scenario) == to_yaml(standard_result.scenario)
    assert summarise(read) == summarise(standard_result), "all numbers of a run can be had from its file"


@pytest.mark.parametrize("name", ["b_type_wall", "wagon_80t"])
def test_results_with_a_wall_or_an_unequal_partner_are_read_back(name, tmp_path):
    result = run(load(name, {"simulation.time_limit_s": 0.2}))
    result.save(tmp_path / "r.nc")
    assert summarise(load_result(tmp_path / "r.nc")) == summarise(result)


@pytest.mark.thorough
def test_a_result_of_long_measured_curves_can_be_saved(tmp_path):
    """Not every format of files keeps texts of more than 64 kB."""
    u = 900 * np.linspace(0, 1, 900) ** 1.01  # all digits of a number, to be long with few points
    curves = {
        name: {"stroke_mm": u.tolist(), "force_kN": (700 + 100 * np.sin(k * u)).tolist()}
        for k, name in enumerate("abc", start=1)
    }
    small = scenario([(0, 0), (10, 500), (500, 500)], 100, step_ms=0.1, time_limit_s=0.2)
    long = small.with_values({"curves": curves, "devices.d.curve": "a"})
    assert len(to_yaml(long)) > 80_000
    result = run(long)
    result.save(tmp_path / "long.nc")
    assert summarise(load_result(tmp_path / "long.nc")) == summarise(result)


def test_the_file_is_plain_netcdf_with_names_and_units(saved, standard_result):
    with xr.open_dataset(saved, decode_timedelta=False) as data:
        sizes = {"time": len(standard_result.time), "vehicle": 12, "interface": 11, "element": 11, "contact": KEPT}
        assert dict(data.sizes) == sizes
        assert data["force"].sel(interface="S1-M1").max() == standard_result.force[:, 5].max()
        assert data["velocity"].sel(vehicle="M1")[0] == pytest.approx(25 / 3.6)
        units = {name: data[name].attrs["units"] for name in ("force", "stroke", "velocity", "energy", "acceleration")}
        assert units == {"force": "N", "stroke": "m", "velocity": "m/s", "energy": "J", "acceleration": "m/s2"}
        assert all("units" in data[name].attrs for name in data.data_vars)
        assert "b_type" in data.attrs["scenario"]
        assert data.attrs["version_mujoco"].startswith("4.")


# histories themselves


def test_records_begin_at_the_start_and_are_evenly_spaced(standard_result):
    r = standard_result
    assert r.time[0] == 0.0
    assert np.diff(r.time) == pytest.approx(1e-3)
    assert r.velocity[0] == pytest.approx(r.chain.speed)
    assert (r.force[0] == 0).all()
    assert r.tally.time == pytest.approx(r.time[-1], abs=1.01e-3)


def test_records_agree_with_each_other(standard_result):
    r = standard_result
    assert r.stroke == pytest.approx(r.position[:, :-1] - r.position[:, 1:], abs=1e-12)
    assert r.stroke_rate == pytest.approx(r.velocity[:, :-1] - r.velocity[:, 1:], abs=1e-12)
    force = np.pad(r.force, ((0, 0), (1, 1)))
    devices = (force[:, :-1] - force[:, 1:]) / r.chain.mass
    assert np.abs(r.acceleration - devices).max() <= 0.008 * 9.80665 * (1 + 1e-6), "what is left is rail friction"


def test_recording_less_often_records_the_same_states():
    every, tenth = (
        run(load("b_type", {"simulation.record_every_ms": t, "simulation.time_limit_s": 0.1})) for t in (1, 10)
    )
    n = len(tenth.time)
    for name in ("time", "position", "velocity", "acceleration", "force", "energy"):
        assert np.array_equal(getattr(tenth, name), getattr(every, name)[::10][:n]), name


# tables


def test_table_has_one_row_per_record_and_units_in_its_heads(standard_result):
    table = standard_result.table()
    assert len(table) == len(standard_result.time)
    assert len(table.columns) == 2 + 3 * 12 + 3 * 11
    first, last = standard_result.time[[0, -1]]
    assert table["time_s"].iloc[[0, -1]].tolist() == [first, last]
    assert table["velocity_M1_km_h"].iloc[0] == pytest.approx(25.0)
    assert table["force_S1-M1_kN"].max() == pytest.approx(standard_result.force[:, 5].max() / 1e3)
    assert table["stroke_S1-M1_mm"].max() == pytest.approx(standard_result.stroke[:, 5].max() * 1e3 / 2), "of one train"
    assert table["energy_M1-M2_kJ"].iloc[-1] == pytest.approx(standard_result.energy[-1, 4] / 1e3)
    assert table["acceleration_M1_g"].abs().max() == pytest.approx(
        np.abs(standard_result.acceleration[:, 5]).max() / 9.80665
    )


def test_histories_of_an_unequal_front_end_where_the_tables_stand():
    """One column for each train's device: largest stroke, permanent set and energy as in interfaces.csv."""
    v = values([(0, 0), (400, 2000)], 1000, partner="u", speed_m_s=4.0, step_ms=0.05, time_limit_s=1.0)
    v["devices"]["soft"] = {"curve": {"stroke_mm": [0, 20, 400], "force_kN": [0, 2000, 2000]}, "stiffness_kN_per_mm": 5}
    v["trains"]["u"] = {**v["trains"]["t"], "front": "soft"}
    result = run(Scenario.from_values(v))
    table = result.table()
    for side in summarise(result).interfaces:
        name = side.name.replace(" ", "_")
        assert table[f"stroke_{name}_mm"].max() == pytest.approx(side.stroke_mm, rel=1e-3)
        assert table[f"stroke_{name}_mm"].iloc[-1] == pytest.approx(side.permanent_mm, abs=0.5)
        assert table[f"energy_{name}_kJ"].iloc[-1] == pytest.approx(side.energy_kJ, rel=1e-3, abs=1e-9)


# what cannot be read or written


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "there is no such file"),
        (b"", "is not a readable NetCDF file"),
        (b"not a result at all", "is not a readable NetCDF file"),
        (b"\x89HDF\r\n\x1a\n" + b"\0" * 500, "is an HDF5 file; .* compute it again"),
    ],
)
def test_files_that_are_no_results_are_refused(tmp_path, content, said):
    file = tmp_path / "r.nc"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(InputError, match=said) as caught:
        load_result(file)
    assert str(file) in str(caught.value)


def test_a_damaged_file_is_refused(saved, tmp_path):
    whole = saved.read_bytes()
    file = tmp_path / "cut.nc"
    file.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"cut\.nc: is damaged, or was changed"):
        load_result(file)


def test_a_damaged_byte_is_found_wherever_it_is(saved, tmp_path):
    """A wrong number from a damaged file would look like any other."""
    whole = saved.read_bytes()
    file = tmp_path / "flipped.nc"
    for place in np.random.default_rng(1).integers(0, len(whole), 200):
        file.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        with pytest.raises(InputError, match=r"is damaged|is not"):
            load_result(file)


@pytest.mark.parametrize(("name", "count"), [(b"time", 100_000), (b"position", 2**31 - 1)])
def test_a_file_that_claims_more_than_it_has_is_refused_though_its_checksum_is_right(saved, tmp_path, name, count):
    """Someone who makes such a file can also seal it; it must not take all memory."""
    whole = saved.read_bytes()
    at = whole.index(len(name).to_bytes(4, "big") + name) + 4 + len(name)
    file = tmp_path / "claims.nc"
    file.write_bytes(signed(whole[:at] + count.to_bytes(4, "big") + whole[at + 4 :]))
    with pytest.raises(InputError, match=r"claims\.nc: "):
        load_result(file)


def test_a_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_result(tmp_path)


def test_netcdf_files_of_others_are_refused(tmp_path):
    xr.Dataset({"x": ("t", [1.0, 2.0])}).to_netcdf(tmp_path / "x.nc", engine="scipy")
    with pytest.raises(InputError, match="is not a result of this trainmj"):
        load_result(tmp_path / "x.nc")


@pytest.mark.parametrize("lost", ["tally_element_state_0", "force"])
def test_a_result_that_lost_a_variable_is_refused(standard_result, tmp_path, lost):
    """As one of an earlier version may have."""
    file = tmp_path / "less.nc"
    file.write_bytes(by_xarray(standard_result.dataset().drop_vars(lost)))
    with pytest.raises(InputError, match=f"is not a whole result: {lost} is missing"):
        load_result(file)


def test_what_is_read_is_what_another_reader_finds(saved):
    attributes, variables = unpacked(saved.read_bytes())
    with netcdf_file(saved, mmap=False) as data:
        assert {name: stored.values().tobytes() for name, stored in variables.items()} == {
            name: variable.data.tobytes() for name, variable in data.variables.items()
        }
        assert {name: variable.shape for name, variable in data.variables.items()} == {
            name: stored.shape for name, stored in variables.items()
        }
        assert attributes["scenario"].value() == data.scenario.decode()
        assert attributes["step_ms"].value() == data.step_ms


def test_a_variable_that_no_result_has_is_refused_and_not_decoded(short_result, tmp_path):
    """Breaks if someone's file takes several times its size of memory."""
    data = short_result.dataset()
    file = tmp_path / "more.nc"
    file.write_bytes(by_xarray(data.assign(more=("rows", np.zeros(2_000_000)))))
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=r"more\.nc: has a variable 'more', which no result of its scenario has"):
            load_result(file)
        assert tracemalloc.get_traced_memory()[1] < 1.5 * file.stat().st_size
    finally:
        tracemalloc.stop()


def test_attributes_that_no_result_has_are_not_decoded_and_long_ones_refused(short_result, tmp_path):
    data, deep = short_result.dataset(), "[" * 3_000_000
    file = tmp_path / "deep.nc"
    file.write_bytes(by_xarray(data.assign_attrs(title=deep, more=deep)))
    assert summarise(load_result(file)) == summarise(short_result)
    for name in ("version_numpy", "format", "step_ms"):
        file.write_bytes(by_xarray(data.assign_attrs({name: deep})))
        with pytest.raises(InputError, match=f"{name} is too long"):
            load_result(file)
    file.write_bytes(by_xarray(data.assign_attrs({f"more{n}": 1 for n in range(1001)})))
    with pytest.raises(InputError, match="has too many entries"):
        load_result(file)


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize(
    ("name", "at", "place"),
    [
        ("force", (5, 3), "force is VALUE at time 5, interface 3"),
        ("position", (0, 1), "position is VALUE at time 0, vehicle 1"),
        ("tally_time", (), "tally_time is VALUE, and"),
        ("tally_total_peak", (2,), "tally_total_peak is VALUE at vehicle 2"),
        ("tally_steps", (), "tally_steps is VALUE, and"),
    ],
)
def test_values_that_are_not_finite_are_refused(short_result, tmp_path, name, at, place, value):
    """Breaks if such a file reaches figures and reports, which show no trace of it."""
    data = short_result.dataset()
    values = data[name].to_numpy().copy()
    values[at] = value
    file = tmp_path / "lost.nc"
    file.write_bytes(by_xarray(data.assign({name: (data[name].dims, values)})))
    with pytest.raises(InputError, match=rf"lost\.nc: {place.replace('VALUE', str(value))}.* must be finite"):
        load_result(file)


def test_a_run_that_became_unstable_is_read_and_says_so(short_result, tmp_path):
    tally = changed(short_result.tally, stroke_max=short_result.tally.stroke_max * np.nan)
    replace(short_result, tally=tally).save(tmp_path / "unstable.nc")
    assert str(summarise(load_result(tmp_path / "unstable.nc")).status).startswith("unstable: a value is not finite")


def test_forged_heads_whose_checksum_is_right_end_in_a_result_or_a_message(short_result, tmp_path):
    """Breaks if one ends in a traceback: sizes, places, types and counts of all kinds are hit."""
    file = tmp_path / "forged.nc"
    short_result.save(file)
    whole, refused = file.read_bytes(), 0
    begin, end = whole.index(b"version_"), whole.rindex(b"_FillValue")
    rng = np.random.default_rng(2)
    for place in rng.integers(begin, end, 60).tolist():
        file.write_bytes(signed(whole[:place] + rng.bytes(1) + whole[place + 1 :]))
        try:
            load_result(file)
        except InputError:
            refused += 1
    assert 20 < refused < 60, "some hit texts that are not read"


@pytest.mark.parametrize(
    "wrong",
    [lambda t: t * np.nan, lambda t: t[::-1], lambda t: t * 0, lambda t: t * 1e300, lambda t: t + 1, lambda t: -t],
    ids=["nan", "falling", "still", "for ever", "late", "negative"],
)
def test_times_that_do_not_grow_from_0_to_the_limit_are_refused_though_the_checksum_is_right(
    standard_result, tmp_path, wrong
):
    """Breaks if such a file reaches films and reports, which end in a traceback."""
    data = standard_result.dataset()
    file = tmp_path / "forged.nc"
    file.write_bytes(by_xarray(data.assign_coords(time=("time", wrong(data["time"].values)))))
    with pytest.raises(InputError, match="time does not grow from 0 s to the time limit"):
        load_result(file)


@pytest.mark.parametrize("where", ["missing/r.nc", "."])
def test_a_result_that_cannot_be_written_is_an_output_error(standard_result, tmp_path, where):
    with pytest.raises(OutputError, match="cannot be written"):
        standard_result.save(tmp_path / where)


# the figure


@pytest.mark.parametrize("name", ["b_type", "b_type_wall", "wagon_80t"])
def test_figure_shows_speeds_strokes_forces_and_energies_with_units(name):
    result = run(load(name, {"simulation.time_limit_s": 0.1}))
    figure = collision(result)
    axes = figure.get_axes()
    shared = " (front: one train's side)" if result.chain.interfaces[result.chain.front].equal_sides else ""
    assert [a.get_title(loc="left") for a in axes] == ["Speed", "Stroke", "Force", "Absorbed energy"]
    assert [a.get_ylabel() for a in axes] == ["km/h", f"mm{shared}", "kN", f"kJ{shared}"]
    assert [a.get_xlabel() for a in axes[2:]] == ["Time (s)"] * 2
    assert len(axes[0].lines) == len(result.chain.vehicles)
    forces = [line for line in axes[2].lines if line.get_label() != "_limit"]
    assert len(forces) == result.chain.n_moving, "the interfaces of the moving train"


@pytest.mark.thorough
@pytest.mark.parametrize("width", ["column", "page"])
def test_nothing_in_the_figure_lies_over_the_names_of_lines(standard_result, width, recwarn):
    """A title that runs into the legend of its panel could not be read; one in another script warns nobody."""
    result = replace(standard_result, scenario=standard_result.scenario.with_values({"title": "\u4e2d $x^2$"}))
    figure = collision(result, width)
    encode(figure, "png")
    assert not recwarn.list, [str(w.message) for w in recwarn.list]
    with styled(width), warnings.catch_warnings(action="ignore"):
        figure.draw_without_rendering()  # at its own resolution, not that of the file
    for axes in figure.get_axes()[:2]:
        title, legend = axes._left_title.get_window_extent(), axes.get_legend().get_window_extent()
        assert title.width > 0
        assert not legend.overlaps(title)


@pytest.mark.thorough
@pytest.mark.parametrize("width", ["column", "page"])
def test_the_longer_names_of_an_unequal_front_leave_the_title_free(width):
    """Both trains' devices at the front of an eight-car train are named above the strokes."""
    figure = collision(run(load("wagon_80t", {"simulation.time_limit_s": 0.05})), width)
    with styled(width):
        figure.draw_without_rendering()
    strokes = figure.get_axes()[1]
    assert not strokes.get_legend().get_window_extent().overlaps(strokes._left_title.get_window_extent())


def test_figure_shows_the_front_as_the_tables_do(standard_result, standard_summary):
    """Stroke and energy of one train, force of both."""
    _, strokes, forces, energies = collision(standard_result).get_axes()
    front = standard_summary.interfaces[0]
    top = [float(np.max(a.lines[0].get_ydata())) for a in (strokes, forces, energies)]
    assert top == pytest.approx([front.stroke_mm, front.peak_force_kN, front.energy_kJ], rel=2e-3)
