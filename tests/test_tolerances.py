"""Tolerances: what scatters, around what, and the collisions that it makes."""

from __future__ import annotations

import numpy as np
import pytest
from builders import each_alone, points
from scipy import stats
from scipy.special import ndtri

import trainmj
from trainmj.cases.engine import Local
from trainmj.cases.scatter import scatter_of, together
from trainmj.collision.lineup import line_up
from trainmj.errors import InputError
from trainmj.single.devices import table, users

HEAD = {
    "stages": {
        "coupler": {"curve": ["buffer", points((74, 700), (200, 700))], "shear_off": {"force_kN": 900, "ramp_mm": 0.5}},
        "climber": {"empty_stroke_mm": 30, "curve": points((0, 0), (1, 900), (400, 1100)), "stroke_limit_mm": 265},
    },
    "stiffness_kN_per_mm": 400,
}
VALUES = {
    "parameters": {"mass_t": "trains.two.mass_t", "both": ["devices.head.stiffness_kN_per_mm", "collision.gap_mm"]},
    "curves": {"buffer": points((0, 0), (40, 400), (73, 600))},
    "devices": {"head": HEAD, "link": {"curve": points((0, 0), (50, 600), (500, 800)), "stiffness_kN_per_mm": 300}},
    "trains": {
        "two": {
            "vehicles": [{"name": "A"}, {"name": "B"}], "mass_t": 30, "length_m": 18,
            "front": "head", "rear": "link", "coupler": "link",
        },
    },
    "collision": {"train": "two", "partner": "two", "speed_km_h": 20, "gap_mm": 10},
    "simulation": {"step_ms": 0.5, "time_limit_s": 0.6},
}  # fmt: skip


def scenario(tolerances, **changes):
    return trainmj.Scenario.from_values(VALUES | {"tolerances": tolerances}).with_values(changes)


def values_at(tolerance, quantile, **changes):
    """The value that a single tolerance of the gap takes at a quantile."""
    (case,) = scatter_of(scenario({"gap": {"of": "collision.gap_mm"} | tolerance}, **changes)).cases(
        [[ndtri(quantile)]]
    )
    return case["collision.gap_mm"]


@pytest.mark.parametrize("quantile", [0.001, 0.2, 0.5, 0.97])
def test_each_distribution_has_the_quantiles_of_its_name(quantile):
    """Breaks if a key of a tolerance is taken for another one: a range for bounds, a percentage for half of it."""
    normal = stats.norm(10, 0.5).ppf(quantile)
    assert values_at({"sigma": 0.5}, quantile) == pytest.approx(normal, rel=1e-12)
    assert values_at({"percent": 5}, quantile) == pytest.approx(normal, rel=1e-12)
    assert values_at({"range": [8.5, 11.5]}, quantile) == pytest.approx(normal, rel=1e-12)
    assert values_at({"mean": 20, "percent": 5}, quantile) == pytest.approx(stats.norm(20, 1).ppf(quantile), rel=1e-12)
    assert values_at({"kind": "uniform", "percent": 5}, quantile) == pytest.approx(9.5 + quantile, rel=1e-12)
    assert values_at({"kind": "uniform", "range": [3, 7]}, quantile) == pytest.approx(3 + 4 * quantile, rel=1e-12)
    cut = stats.truncnorm(-2, 2, 10, 0.5).ppf(quantile)
    assert values_at({"kind": "truncated_normal", "sigma": 0.5, "cut_sigma": 2}, quantile) == pytest.approx(cut)
    assert values_at({"kind": "truncated_normal", "sigma": 0.5, "range": [9, 11]}, quantile) == pytest.approx(cut)


def test_a_lognormal_has_the_mean_and_deviation_that_are_stated():
    """Breaks if they are taken for those of the logarithm."""
    z = ndtri((np.arange(20_000) + 0.5) / 20_000)[:, None]
    scatter = scatter_of(scenario({"gap": {"of": "collision.gap_mm", "kind": "lognormal", "percent": 30}}))
    gaps = [case["collision.gap_mm"] for case in scatter.cases(z)]
    assert (np.mean(gaps), np.std(gaps)) == (pytest.approx(10, rel=1e-3), pytest.approx(3, rel=5e-3))
    ends = [values_at({"kind": "lognormal", "range": [5, 20]}, stats.norm.cdf(s)) for s in (-3, 0, 3)]
    assert ends == pytest.approx([5, 10, 20])


def test_discrete_values_come_as_often_as_stated():
    """Breaks if probabilities are matched with the wrong values."""
    gap = {"of": "collision.gap_mm", "kind": "discrete", "values": [0, 5, 20], "probabilities": [0.2, 0.5, 0.3]}
    scatter = scatter_of(scenario({"gap": gap}))
    z = ndtri((np.arange(1000) + 0.5) / 1000)[:, None]
    found = [case["collision.gap_mm"] for case in scatter.cases(z)]
    assert [found.count(value) for value in (0, 5, 20)] == [200, 500, 300]


def test_independent_copies_are_those_of_both_trains_and_of_every_device_where_it_stands():
    """Breaks if a vehicle, or a device of a twin, is left without a draw of its own."""
    percent = {"percent": 1, "copies": "independent"}
    devices = {"of": ["devices.head", "devices.link"], "scales": "force", **percent}
    scatter = scatter_of(scenario({"m": {"of": "mass_t", **percent}, "c": devices}))
    assert scatter.names == (
        "m M1", "m M2", "m S1", "m S2", "c S1-M1", "c S1-M1 partner", "c M1-M2", "c S1-S2",
    )  # fmt: skip
    (case,) = scatter.cases([[0, 1, 0, -1, 0, 2, 0, 0]])
    built = case["as_built"]
    assert [built[place]["mass_t"] for place in ("M1", "M2", "S1", "S2")] == pytest.approx([30, 30.3, 30, 29.7])
    assert built["S1-M1 partner"]["stages.climber.curve"]["force_kN"] == pytest.approx([0, 918, 1122])
    assert built["S1-M1 partner"]["stages.coupler.shear_off.force_kN"] == pytest.approx(918)
    assert built["M1-M2"]["curve"]["force_kN"] == pytest.approx([0, 600, 800])


def test_same_copies_are_one_draw_and_strokes_scale_too():
    """Breaks if one draw for all sets the value of one vehicle, or a factor of strokes changes forces."""
    of_front = {"of": "devices.head.stages.climber", "scales": "stroke", "sigma": 0.1, "copies": "same"}
    scatter = scatter_of(scenario({"m": {"of": "mass_t", "sigma": 0.5, "copies": "same"}, "front": of_front}))
    (case,) = scatter.cases([[2, 1]])
    assert case["trains.two.mass_t"] == 31
    curve = case["devices.head.stages.climber.curve"]
    assert (curve["stroke_mm"], curve["force_kN"]) == (pytest.approx([0, 1.1, 440]), pytest.approx([0, 900, 1100]))
    assert "as_built" not in case


def test_a_factor_of_a_kind_and_one_of_each_copy_multiply():
    """Breaks if the one that is drawn later replaces the other one."""
    force = {"of": "devices.link", "scales": "force", "sigma": 0.1}
    scatter = scatter_of(scenario({"batch": {**force, "copies": "same"}, "each": {**force, "copies": "independent"}}))
    (case,) = scatter.cases([[1, 1, -1]])
    forces = [case["as_built"][place]["curve"]["force_kN"][1] for place in ("M1-M2", "S1-S2")]
    assert forces == pytest.approx([600 * 1.1 * 1.1, 600 * 1.1 * 0.9])


def test_correlation_is_that_of_parts_of_one_place_and_of_one_with_all():
    """Breaks if the mass of one vehicle is correlated with the friction of another one."""
    copies = {"copies": "independent"}
    mass = {"of": "mass_t", "sigma": 1, "correlated": {"grease": 0.6, "batch": 0.3}, **copies}
    grease = {"of": "trains.two.rail_friction", "kind": "uniform", "range": [0.001, 0.01], **copies}
    scatter = scatter_of(scenario({"mass": mass, "grease": grease, "batch": {"of": "collision.gap_mm", "sigma": 1}}))
    y = scatter.scores(np.random.default_rng(1).standard_normal((40_000, scatter.d)))
    expected = np.eye(9)
    for k in range(4):
        expected[k, k + 4] = expected[k + 4, k] = 0.6
        expected[k, 8] = expected[8, k] = 0.3
    assert np.corrcoef(y.T) == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize(
    ("tolerance", "said"),
    [
        ({"of": "mass_t", "percent": 1}, "tolerances.t: leads to 4 vehicles or devices: state copies: independent"),
        ({"of": "mas_t", "percent": 1}, "t.of = 'mas_t': mas_t: there is no 'mas_t' .* mean 'mass_t'"),
        ({"of": "devices.head", "percent": 1, "copies": "same"}, "head is no number: state scales: force or"),
        ({"of": "mass_t", "scales": "force", "percent": 1, "copies": "same"}, "is no curve, and no device or stage"),
        ({"of": "collision.gap_mm", "percent": 1, "copies": "independent"}, "collision.gap_mm is none, or not used"),
        ({"of": "collision.partner_speed_km_h", "percent": 1}, "partner_speed_km_h is no number: state the value"),
        ({"of": "collision.gap_mm", "mean": 0, "percent": 1}, "a percentage of 0 is no tolerance: state sigma"),
        ({"of": "collision.gap_mm", "kind": "uniform", "percent": 1}, "a percentage of 0 is no tolerance"),
        ({"of": "collision.gap_mm", "kind": "truncated_normal", "sigma": 1, "range": [2, 3]}, "the mean, 0, must lie"),
        ({"of": "collision.gap_mm", "kind": "lognormal", "sigma": 1}, "a lognormal distribution needs a mean above 0"),
        ({"of": "collision.gap_mm", "percent": 1, "sigma": 1}, "needs one of sigma, percent, range, and has sigma and"),
        ({"of": "collision.gap_mm", "sigma": 1, "correlated": {"u": 0.5}}, "there is no tolerance of this name"),
        ({"of": "mass_t", "scales": "force", "range": [-1, 1], "copies": "same"}, "range.*must be above 0: factors"),
        ({"of": ["devices.link", "devices.link.curve"], "scales": "force", "percent": 1, "copies": "same"},
         "leads to one curve twice, by devices.link and devices.link.curve"),
        ({"of": "devices.link", "kind": "discrete", "values": [{}, {}], "copies": "independent"}, "is a whole device"),
    ],
)  # fmt: skip
def test_a_tolerance_that_says_nothing_is_refused_with_its_place(tolerance, said):
    """Breaks if what scatters nothing, or something else than is meant, is drawn without a word."""
    with pytest.raises(InputError, match=said):
        scatter_of(scenario({"t": tolerance}, **{"collision.gap_mm": 0}))


def test_tolerances_that_do_not_go_together_are_refused():
    """Breaks if two draws set one value, a correlation has no effect, or none of its kind can exist."""
    gap = {"of": "collision.gap_mm", "sigma": 1}
    with pytest.raises(InputError, match=r"tolerances\.b: sets collision\.gap_mm, as a does"):
        scatter_of(scenario({"a": gap, "b": gap}))
    each = {"percent": 1, "copies": "independent"}
    links = {"of": "devices.link", "scales": "force", **each}
    with pytest.raises(InputError, match="no vehicle or device has both a and b: state copies: same for one of them"):
        scatter_of(scenario({"a": {"of": "mass_t", **each, "correlated": {"b": 0.5}}, "b": links}))
    others = {
        "b": {"of": "speed", "sigma": 1},
        "c": {"of": "devices.link.stiffness_kN_per_mm", "sigma": 1, "copies": "same"},
    }
    others["b"] |= {"of": "collision.speed_km_h", "correlated": {"c": -0.9}}
    with pytest.raises(InputError, match=r"tolerances: correlation .* make them smaller"):
        scatter_of(scenario({"a": gap | {"correlated": {"b": 0.9, "c": 0.9}}, **others}))
    named = {"of": "curves.buffer", "scales": "force", "percent": 1}
    heads = {"of": "devices.head", "scales": "force", **each}
    with pytest.raises(InputError, match=r"a\.of.*changes the curve buffer, which b scales in a device that has it"):
        scatter_of(scenario({"a": named, "b": heads}))
    turned = {"of": "collision.train_end", "kind": "discrete", "values": ["front", "rear"]}
    with pytest.raises(InputError, match="a: with 'rear' others stand where single vehicles or devices differ"):
        scatter_of(scenario({"a": turned, "b": {"of": "mass_t", **each}}))
    with pytest.raises(InputError, match="as_built: does not go with tolerances"):
        scatter_of(scenario({"a": gap}, as_built={"M1": {"mass_t": 31}}))


def test_what_scatters_belongs_to_the_vehicle_wherever_it_stands():
    """Breaks if the head of the train as built becomes its tail when the train runs the other way round."""
    mass = {"m": {"of": "mass_t", "percent": 1, "copies": "independent"}}
    cases = {"front": scenario(mass), "rear": scenario(mass, **{"collision.train_end": "rear"})}
    fleet = together({name: scatter_of(one) for name, one in cases.items()})
    assert fleet.names == ("m M1", "m M2", "m S1", "m S2")
    z = np.array([[1.0, -1.0, 2.0, 0.5]])
    (front,), (rear,) = fleet.cases("front", z), fleet.cases("rear", z)
    assert front["as_built"]["M1"] == rear["as_built"]["M2"] == {"mass_t": pytest.approx(30.3)}
    assert front["as_built"]["S1"] == rear["as_built"]["S1"] == {"mass_t": pytest.approx(30.6)}
    assert fleet.cases("rear", z)[0]["as_built"]["M1"] == {"mass_t": pytest.approx(29.7)}


def test_as_built_is_the_same_to_the_bit_as_a_scenario_that_states_it_otherwise():
    """Breaks if a value under as_built goes another way into the collision than one of a vehicle or device."""
    plain = scenario({})
    masses = {f"trains.two.vehicles.{k}.mass_t": m for k, m in enumerate((31, 28))}
    built = {"M1": {"mass_t": 31}, "M2": {"mass_t": 28}, "S1": {"mass_t": 31}, "S2": {"mass_t": 28}}
    curve = points((0, 0), (50, 660), (500, 880))
    stated = plain.with_values({**masses, "devices.link.curve": curve})
    altered = plain.with_values({"as_built": built | {place: {"curve": curve} for place in ("M1-M2", "S1-S2")}})
    assert trainmj.summarise(trainmj.run(stated)).row() == trainmj.summarise(trainmj.run(altered)).row()


def test_a_vehicle_as_built_keeps_what_it_takes_over_from_its_train():
    """Breaks if one value of brakes or load as built takes the others of the train away, or a vehicle is left out."""
    load = {"trains.two.load": {"seats": 100, "share": 0.5, "kg": 80}, "trains.two.vehicles.0.load": {"share": 0.9}}
    brakes = {"force_kN": 40, "delay_s": 0.1, "adhesion": 0.1}
    plain = scenario({}, **load, **{"trains.two.brakes": brakes})
    stated = plain.with_values({"trains.two.vehicles.1.brakes": brakes | {"force_kN": 20}})
    altered = plain.with_values({"as_built": {place: {"brakes.force_kN": 20} for place in ("M2", "S2")}})
    assert altered.built.vehicles["M2"].brakes == stated.trains["two"].each()[1].brakes
    assert trainmj.summarise(trainmj.run(stated)).row() == trainmj.summarise(trainmj.run(altered)).row()
    tolerances = {
        "kg": {"of": "trains.two.load.kg", "percent": 1, "copies": "independent"},
        "share": {"of": "trains.two.load.share", "percent": 1, "copies": "independent"},
        "brakes": {"of": "trains.two.brakes.force_kN", "percent": 1, "copies": "independent"},
    }
    names = scatter_of(plain.with_values({"tolerances": tolerances})).names
    assert names[:6] == ("kg M1", "kg M2", "kg S1", "kg S2", "share M2", "share S2")
    assert names[6:] == ("brakes M1", "brakes M2", "brakes S1", "brakes S2")


@pytest.mark.parametrize(
    ("place", "changes", "said"),
    [
        ("M1", {"front": "link"}, "M1: front: is a device, which has a place of its own, such as S1-M1"),
        ("M1-M2", {"curve.force_kN.-1": 900}, "force_kN.-1: leads to no value"),
        ("M1-M2", {"curve": "buffer", "curve.force_kN.1": 900}, "force_kN.1: is in curve, which is set too"),
    ],
)
def test_what_would_not_be_built_is_refused(place, changes, said):
    """Breaks if a value under as_built is without effect and nobody says so."""
    with pytest.raises(InputError, match=said):
        scenario({}, as_built={place: changes})


def test_the_device_of_a_kind_is_shown_and_not_one_that_differs():
    """Breaks if the curve and limits of a single device as built are shown as those of all."""
    built = {"S1-M1": {"curve.force_kN.1": 900, "stroke_limit_mm": 100}}
    altered = scenario({}, **{"trains.two.front": "link", "as_built": built})
    chain = line_up(altered)
    assert [place.name for place in users(chain, altered.as_built)["link"]][-1] == "S1-M1"
    assert users(chain, altered.as_built)["link"][0].device.is_like(line_up(scenario({})).interfaces[0].devices[0])
    (row,) = table(altered, chain).rows
    assert "100" not in str(row)


def test_what_is_as_built_stays_the_same_vehicle():
    """Breaks if the head as built becomes the tail, in an assessment or a load case that turns the train round."""
    built = scenario({}, as_built={"M1": {"mass_t": 31}})
    turned = {"collision.train_end": "rear"}
    with pytest.raises(InputError, match="M1 would be another vehicle or device with"):
        built.with_values(turned)
    assert built.with_values(turned | {"as_built": {"M2": {"mass_t": 31}}}).built.vehicles["M2"].mass_t == 31
    assert built.with_values({"collision.partner": "rigid_wall"}).built.vehicles["M1"].mass_t == 31


def test_a_stroke_limit_as_built_is_judged_where_it_stands():
    """Breaks if the largest stroke hides a smaller one that is past a limit of its own."""
    plain = scenario({}, **{"devices.link.stroke_limit_mm": 400, "trains.two.front": "link"})
    altered = plain.with_values({"as_built": {"M1-M2": {"stroke_limit_mm": 5}}})
    found, *_ = trainmj.summarise(trainmj.run(altered)).limits
    assert (found.where, found.limit, found.kept) == ("M1-M2", 5, False)
    other = plain.with_values({"as_built.M1-M2.stroke_limit_mm": 5, "as_built.M2.mass_t": 30})
    assert other.as_built == {"M1-M2": {"stroke_limit_mm": 5}, "M2": {"mass_t": 30}}
    deep = other.with_values({"as_built.M1-M2.curve.force_kN.1": 900})
    assert deep.built.devices["M1-M2"].curve.force_kN == [0, 900, 800]


def test_a_batch_of_draws_is_the_single_runs_to_the_bit():
    """Breaks if cases of one batch share a device that differs, or a draw is changed on its way."""
    tolerances = {
        "mass": {"of": "mass_t", "percent": 2, "copies": "independent"},
        "head": {"of": "devices.head", "scales": "force", "percent": 5, "copies": "independent"},
        "link": {"of": "devices.link", "scales": "stroke", "percent": 5, "copies": "independent"},
    }
    base = scenario(tolerances)
    cases = scatter_of(base).cases(np.random.default_rng(3).standard_normal((6, 8)))
    batch = {rows.keys[0]: rows.row(0) for rows in each_alone(Local(base, 1)([cases]))}
    single = [trainmj.summarise(trainmj.run(base.with_values(case))).row() for case in cases]
    assert repr([batch[k] for k in range(6)]) == repr(single)  # as nan is no other nan
    assert len({row["TS_mm"] for row in single}) == 6
