"""trainmj explore: what it serves and to whom, and that what it says is what trainmj run computes."""

from __future__ import annotations

import http.client
import json
import shlex
import socket
import threading
from pathlib import Path

import pytest
from click.testing import CliRunner

import trainmj
from trainmj.cli import main
from trainmj.cli.options import set_again
from trainmj.collision.wear import Wear, seen_at
from trainmj.explore import server
from trainmj.explore.page import html
from trainmj.explore.session import Session, thinned
from trainmj.explore.values import parameters_of, values_of
from trainmj.output.blocks import Section
from trainmj.output.page import fragment
from trainmj.scenario import from_yaml
from trainmj.single.page import subjects

EVERY_KIND = Path(__file__).parent / "every_kind.yaml"
COARSE = {"simulation.step_ms": 0.5}
TOKEN = "token"


def command(changes):
    return " ".join(["trainmj run b_type", *set_again(changes)])


@pytest.fixture(scope="module")
def session():
    return Session("b_type", trainmj.load("b_type"), COARSE, command)


@pytest.fixture(scope="module")
def port(session):
    """Served in a thread, as the command serves it."""
    uvicorn = pytest.importorskip("uvicorn", reason="needs the extra explore")
    with server.listening(0) as found:
        number = found.getsockname()[1]
        config = uvicorn.Config(server.application(session, TOKEN, number), **server.SETTINGS)
        running = uvicorn.Server(config)
        thread = threading.Thread(target=running.run, kwargs={"sockets": [found]}, daemon=True)
        thread.start()
        yield number
        running.should_exit = True
        thread.join(10)


def asked(port, path=f"/{TOKEN}/", method="GET", **heads):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request(method, path, headers=heads)
    response = connection.getresponse()
    return response.status, dict(response.getheaders()), response.read().decode()


def test_the_page_is_all_that_is_served(port):
    """Breaks when the page may reach out, be framed or be stored, or when something else is served."""
    status, heads, text = asked(port)
    assert status == 200
    assert f"connect-src ws://127.0.0.1:{port} ws://localhost:{port}" in text
    assert "default-src &#39;none&#39;" in text
    assert "frame-ancestors 'none'" in heads["content-security-policy"]
    assert heads["cache-control"] == "no-store"
    assert heads["referrer-policy"] == "no-referrer"
    assert "access-control-allow-origin" not in heads
    for path in (f"/{TOKEN}/x", f"/{TOKEN}/../x", f"/{TOKEN}/live", f"/{TOKEN}//etc/passwd"):
        assert asked(port, path)[0] == 404
    for method in ("POST", "PUT", "DELETE", "OPTIONS"):
        assert asked(port, method=method)[0] == 405


@pytest.mark.parametrize("path", ["/", "/wrong/", "/wrong/live", "/favicon.ico", f"/{TOKEN[:-1]}/", f"//{TOKEN}/"])
def test_nothing_is_served_without_the_token(port, path):
    """Breaks when an address that leaves out the token, or part of it, is answered."""
    status, _, text = asked(port, path)
    assert status == 403
    assert "whole address" in text
    assert TOKEN not in text


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:1", "[::1]:{port}", ""]
)
def test_a_foreign_name_is_refused(port, host):
    """Breaks when a name that was turned to this machine (DNS rebinding) gets the page."""
    assert asked(port, Host=host.format(port=port))[0] == 403


def connected(port, path=f"/{TOKEN}/live", **options):
    client = pytest.importorskip("websockets.sync.client")
    options.setdefault("origin", f"http://127.0.0.1:{port}")
    return client.connect(f"ws://127.0.0.1:{port}{path}", open_timeout=10, **options)


@pytest.mark.parametrize(
    ("path", "options"),
    [
        (f"/{TOKEN}/live", {"origin": "http://evil.example"}),
        (f"/{TOKEN}/live", {"origin": "http://127.0.0.1:1"}),
        (f"/{TOKEN}/live", {"origin": None}),
        ("/wrong/live", {}),
        (f"/{TOKEN}/", {}),
    ],
    ids=["foreign origin", "other port", "no origin", "wrong token", "the page"],
)
def test_only_the_page_itself_may_connect(port, path, options):
    """Breaks when another page in the browser may ask for collisions."""
    websockets = pytest.importorskip("websockets")
    with pytest.raises(websockets.exceptions.InvalidStatus) as refused, connected(port, path, **options):
        pass
    assert refused.value.response.status_code == 403


def test_the_newest_values_are_answered_and_those_before_them_dropped(port):
    """Breaks when a drag piles up computations, or its last value is not shown."""
    with connected(port) as page:
        for n in range(1, 31):
            changes = {"speed_km_h": 20 + n / 10}
            page.send(json.dumps({"ask": "show", "n": n, "changes": changes, "wanted": ["Outcome"]}))
        answers = [json.loads(page.recv(timeout=20))]
        while answers[-1]["n"] < 30:
            answers.append(json.loads(page.recv(timeout=20)))
        assert len(answers) < 20
        assert [a["n"] for a in answers] == sorted(a["n"] for a in answers)
        assert "at 23 km/h" in answers[-1]["shown"]["subject"]
        assert [s["title"] for s in answers[-1]["shown"]["sections"]] == ["Outcome"]
        page.send(json.dumps({"ask": "save", "n": 30, "changes": changes}))
        assert "speed_km_h: 23" in json.loads(page.recv(timeout=20))["yaml"]


def test_a_message_of_bytes_is_refused(port):
    """Breaks when what no page sends fills the terminal with a traceback."""
    websockets = pytest.importorskip("websockets")
    with connected(port) as page:
        page.send(b"\0")
        with pytest.raises(websockets.exceptions.ConnectionClosed) as closed:
            page.recv(timeout=10)
    assert closed.value.rcvd.code == 1003


@pytest.mark.parametrize(
    "text",
    [
        *("x", "[]", '{"ask": "run"}', '{"ask": "show", "n": "1", "changes": {}}'),
        *('{"ask": "show", "n": 1, "changes": []}', '{"ask": "show", "n": 1, "changes": {"a": {"b": 1}}}'),
        *('{"ask": "show", "n": 1, "changes": {}, "wanted": 3}', "[" * 100_000),
    ],
)
def test_a_message_of_another_form_is_none(text):
    """Breaks when what the page never sends reaches the scenario."""
    assert server.message_of(text) is None


def test_a_fault_is_said_and_the_page_goes_on(session, monkeypatch, capsys):
    """Breaks when something unforeseen closes the page, or is not told."""
    monkeypatch.setattr(session, "answer", lambda *_: 1 / 0)
    said = json.loads(server.answered(session, {"ask": "show", "n": 1, "changes": {}}))
    assert "ZeroDivisionError" in said["wrong"][""]
    assert "Traceback" in capsys.readouterr().err


def test_numbers_are_those_of_run_and_of_the_command(session):
    """Breaks when the page shows other numbers than the command that it hands over, by a bit."""
    changes = {"empty_stroke_mm": 35.5, "curves.buffer.force_kN.8": 790, "devices.front.stiffness_kN_per_mm": 900}
    seen = session.computed(changes)
    told = json.loads(session.told(seen, changes))
    words = shlex.split(told["command"])[3:]
    done = CliRunner().invoke(main, ["run", "b_type", "--json", *words])
    plain = json.loads(done.stdout)
    assert plain["criteria"]["TS_mm"] == seen.summary.values["TS_mm"]
    assert plain["interfaces"] == json.loads(json.dumps([i.as_dict() for i in seen.summary.interfaces]))
    found = {one["name"]: one["text"] for one in told["numbers"]}
    assert found["TS_mm"] == f"{seen.summary.values['TS_mm']:.1f}"
    assert set(seen.summary.responses) <= set(found)
    assert told["changed"].startswith("changed: ")


def test_the_saved_scenario_is_what_was_seen(session):
    """Breaks when the file that the page saves gives other numbers than the page."""
    changes = {"mass_t": 34.5}
    again = trainmj.summarise(trainmj.run(from_yaml(json.loads(session.saved(changes))["yaml"])))
    assert dict(again.responses) == dict(session.computed(changes).summary.responses)


def test_a_bad_value_is_named_where_it_is(session):
    """Breaks when a message does not reach the value that it is about, or hides the others."""
    found = json.loads(session.answer({"mass_t": 3300, "speed_km_h": "fast", "empty_stroke_mm": 30}, "mass_t"))
    assert set(found) == {"wrong"}
    assert set(found["wrong"]) == {"mass_t", "speed_km_h"}
    assert "must be at most 200: masses are in t" in found["wrong"]["mass_t"]
    assert "must be a number" in found["wrong"]["speed_km_h"]
    whole = json.loads(session.answer({"simulation.step_ms": 2, "mass_t": 0.5}, "mass_t"))  # which names neither
    assert set(whole["wrong"]) == {"mass_t"}
    assert "step" in whole["wrong"]["mass_t"]
    rising = json.loads(session.answer({"curves.buffer.stroke_mm.3": 5}, "curves.buffer.stroke_mm.3"))
    assert set(rising["wrong"]) == {"curves.buffer.stroke_mm.3"}


def test_values_have_the_range_of_their_type_and_a_slider_within_it(session):
    """Breaks when a slider leads beyond what its value may be, or a value is not at the path that it is said to be."""
    for scenario in (session.start, trainmj.load(EVERY_KIND), trainmj.load("b_type_vertical")):
        numbers, curves = values_of(scenario)
        assert len(numbers) > 25
        for one in (*numbers, *parameters_of(scenario, numbers)):
            low, high, notch = one.slider()
            stated = [value for value in scenario.locate(one.name) if value is not None]
            assert not stated or one.value in stated
            assert low <= one.value <= high
            assert 0 < notch < high - low
            assert one.least is None or low >= one.least
            assert one.most is None or high <= one.most
            assert scenario.with_values({one.name: one.value})
        for curve in curves:
            for path, strokes, heights in curve.pieces:
                assert scenario.locate(f"{path}.stroke_mm")[0] == strokes
                assert scenario.locate(f"{path}.{curve.height}")[0] == heights
    names = {one["name"]: one for one in session.values["parameters"]}
    assert list(names) == ["mass_t", "empty_stroke_mm", "speed_km_h", "simulation.step_ms"]  # and what was given
    wagon = Session("wagon", trainmj.load("fra_cem_two"), {"collision.gap_mm": 5}, command)  # without short names
    assert [one["name"] for one in wagon.values["parameters"]] == ["collision.gap_mm", "collision.speed_km_h"]
    assert "trains.b_type.mass_t" not in {one["name"] for one in session.values["others"]}  # the same as mass_t


def test_what_is_not_valid_says_so(tmp_path):
    """Breaks when the page shows numbers behind the end of a curve as if they were valid."""
    scenario = trainmj.load(EVERY_KIND, {"devices.open.curve": {"stroke_mm": [0, 10, 30], "force_kN": [0, 200, 300]}})
    own = Session("x", scenario, {}, command)
    told = json.loads(own.told(own.computed({}), {}))
    mark = told["status"]["not_valid"]
    assert mark.startswith("not valid after")
    assert told["status"]["kind"] == "fail"
    of = {section["title"]: section for section in told["sections"]}
    assert "NOT VALID" in of["Outcome"]["html"]
    assert mark in of["Interfaces and vehicles"]["html"]
    assert of["The collision"]["animation"]["valid_until"]
    assert all("shapes" in plot["figure"]["layout"] for plot in of["Over time"]["plots"])


def test_the_page_holds_titles_as_text():
    """Breaks when the title of a scenario can end the data of the page, or bring a script of its own."""
    bad = "</script><script>window.hacked=1</script>"
    text = html(Session("x", trainmj.load("b_type", {**COARSE, "title": bad}), {}, command), "ws://127.0.0.1:1")
    assert "<script>window" not in text


def test_thinned_records_are_for_pictures_only(session):
    """Breaks when a slower record changes more than how finely lines are drawn."""
    seen = session.computed({})
    few = thinned(seen.result, 100)
    assert 50 < len(few.time) <= 100
    assert few.tally is seen.result.tally
    assert few.chain.record_interval == pytest.approx(few.time[1] - few.time[0])
    for title in ("Outcome", "Interfaces and vehicles", "Checks"):
        told = []
        for result in (seen.result, few):
            subjects(result, seen.summary)[title](section := Section(title, ""))
            told.append(fragment(section.blocks))
        assert told[0] == told[1]


def test_what_is_missing_or_in_the_way_is_said(monkeypatch):
    """Breaks when a taken port, a missing extra or a saved result ends in anything but a message."""
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = str(other.getsockname()[1])
        done = CliRunner().invoke(main, ["explore", "b_type", "--no-browser", "--port", taken])
    assert done.exit_code == 2
    assert f"--port {taken}: cannot listen there" in done.stderr
    done = CliRunner().invoke(main, ["explore", "b_type", "--no-browser", "--set", "mass_t=900"])
    assert done.exit_code == 2
    assert "must be at most 200" in done.stderr
    monkeypatch.setattr(server, "find_spec", lambda _: None)
    done = CliRunner().invoke(main, ["explore", "b_type", "--no-browser"])
    assert done.exit_code == 2
    assert "pip install 'trainmj[explore]'" in done.stderr


@pytest.mark.parametrize("name", ["b_type", EVERY_KIND], ids=["without draw gear", "with draw gear"])
def test_devices_show_the_same_along_a_collision_as_record_by_record(name):
    """Breaks when the animation, which takes all records at once, shows other strokes than a film."""
    result = thinned(trainmj.run(trainmj.load(name, {"collision.speed_km_h": 40, "occupants": {}})), 100)
    wear, history = Wear(result.chain), Wear(result.chain).history(result)
    along = {place: worn.along(result.of_device("stroke", *place)) for place, worn in Wear(result.chain).worn.items()}
    for sample in range(len(result.time)):
        wear.update(seen_at(result, sample))
        for place, shown in history.items():
            assert shown[sample] == wear.shown(*place)
            assert along[place][sample] == wear.worn[place].shown
