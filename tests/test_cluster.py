"""Sweeps on a cluster: the same numbers, of workers that have been asked, and one message for whatever fails there."""

import contextlib
import json
import os
import signal
import socket
import sqlite3
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from test_sweep import CASES, _finished, csv_of, said_no, trainmj_sweep, undisturbed  # noqa: F401 the last is a fixture

import trainmj
import trainmj.cases.cluster
from trainmj.collision.identity import identity


@pytest.mark.thorough
def test_dask_with_two_workers_of_which_one_is_killed_gives_the_same_table(undisturbed, tmp_path):  # noqa: F811
    from dask.distributed import Client, LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        from trainmj.cases import cluster as engines

        sweep = trainmj.grid_of(
            trainmj.load("b_type", {"simulation.step_ms": 0.5}),
            {"empty_stroke_mm": "20:50:30", "mass_t": "30,33,36,-1"},
        )
        victims = sorted(client.run(os.getpid).values())
        killed = []

        def progress(finished):
            if 0 < finished < len(sweep) and not killed:
                killed.append(victims[0])
                os.kill(victims[0], signal.SIGKILL)

        engines_before, engines.CASES_PER_TASK = engines.CASES_PER_TASK, 8
        try:
            trainmj.run_sweep(sweep, tmp_path, engine=engines.engine(client, sweep.scenario), progress=progress)
        finally:
            engines.CASES_PER_TASK = engines_before
    assert killed, "no worker was killed while the sweep ran: the test proves nothing"
    assert csv_of(tmp_path) == csv_of(undisturbed[0])


def change_identity(**parts):
    """On a worker: as if other versions were installed."""
    import trainmj.collision.identity as home

    now = tuple((home.identity() | parts).items())
    home._identity = lambda: now


@pytest.mark.thorough
def test_workers_of_another_identity_are_refused_with_what_differs(tmp_path):
    from dask.distributed import Client, LocalCluster

    from trainmj.cases.cluster import engine

    sweep = trainmj.grid_of(trainmj.load("b_type", {"simulation.step_ms": 0.5}), {"mass_t": "30:36:200"})
    mine = identity()
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        one, two = client.scheduler_info()["workers"]
        client.run(change_identity, mujoco="3.3.0", workers=[two])
        with pytest.raises(trainmj.InputError, match=rf"worker {two}: .* mujoco 3.3.0 there, {mine['mujoco']} here"):
            engine(client, sweep.scenario)
        client.run(change_identity, mujoco=mine["mujoco"], platform="a node", workers=[two])
        with pytest.raises(trainmj.InputError, match=r"platform .*a node"):
            engine(client, sweep.scenario)
        client.run(change_identity, platform="a node", workers=[one])
        nodes = engine(client, sweep.scenario)  # all alike, and another processor than the one that hands cases out
        client.run(change_identity, platform="another node", workers=[two])  # one that comes later
        with pytest.raises(trainmj.InputError, match="platform another node there, a node here"):
            trainmj.run_sweep(sweep, tmp_path, engine=nodes)
    with sqlite3.connect(tmp_path / "results.sqlite") as db:
        assert db.execute("SELECT value FROM about WHERE key = 'version_platform'").fetchone() == ("a node",)


def test_what_a_process_computes_with_is_what_it_has_imported(monkeypatch):
    """Breaks if a worker that has been up for long names the version that was installed after its start."""
    from trainmj.collision import identity as home

    before = identity()
    monkeypatch.setattr(home, "code_hash", lambda *parts: "edited")
    monkeypatch.setattr(home, "version", lambda name: "99")
    home._identity.cache_clear()
    assert identity() == before


def test_no_scheduler_at_the_address_is_said(tmp_path):
    done = trainmj_sweep("b_type", *CASES, "--out", tmp_path, "--dask", "nonsense")
    assert said_no(done, "--dask nonsense", "no scheduler")


@pytest.mark.parametrize("banner", [b"", b"SSH-2.0-OpenSSH_9.6\r\n" * 9, b"HTTP/1.1 400 Bad Request\r\n\r\n" * 9])
def test_another_service_at_the_address_is_no_scheduler(tmp_path, monkeypatch, banner):
    """It answers nothing, for ever, or what Dask takes for the size of a message."""
    monkeypatch.setattr("trainmj.cases.cluster._PATIENCE", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as service:

        def answer():
            with contextlib.suppress(OSError):
                while True:
                    callers.append(service.accept()[0])
                    callers[-1].sendall(banner)

        callers = []
        threading.Thread(target=answer, daemon=True).start()
        address = f"tcp://127.0.0.1:{service.getsockname()[1]}"
        done = trainmj_sweep("b_type", *CASES, "--out", tmp_path, "--dask", address)
        service.shutdown(socket.SHUT_RDWR)
    for caller in callers:
        caller.close()
    assert said_no(done, f"--dask {address}", "no scheduler answers at this address (")


@pytest.fixture
def scheduler():
    """A real scheduler without workers, quick to lose patience: the cluster, a client, and how to start a worker."""
    from dask.distributed import Client, LocalCluster

    from trainmj.cases import cluster as engines

    begun = []

    def worker(code="", wait=True):
        there = len(client.nthreads())
        run = "import asyncio, sys\nfrom distributed import Worker\nasync def main():\n    async with Worker("
        run += "sys.argv[1], nthreads=1, dashboard_address=None) as w: await w.finished()\nasyncio.run(main())"
        words = [sys.executable, "-c", f"{code}\n{run}", cluster.scheduler_address]
        begun.append(subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        if wait:
            client.wait_for_workers(there + 1, timeout=60)
        return begun[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engines, "_PATIENCE", 3.0)
        patch.setattr(engines, "_LONGER", 3.0)
        patch.setattr(engines, "CASES_PER_TASK", 8)
        try:
            with LocalCluster(n_workers=0, dashboard_address=None) as cluster, Client(cluster) as client:
                yield cluster, client, worker
        finally:
            for process in begun:
                process.kill()
                process.wait()


MANY = {"mass_t": "30:36:3000"}
FOREIGN = "import sys; sys.modules['trainmj'] = None"
OLD = "import importlib.metadata as m; v = m.version; m.version = lambda n: '3.3.0' if n == 'mujoco' else v(n)"
EDITED = "import trainmj.collision.identity as i; i.IMPORTED['law'] = '0123'"
OTHER_PYTHON = "import platform; platform.python_version = lambda: '3.99'"


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("code", "said"),
    [
        (FOREIGN, "trainmj cannot be used there .*: install the same version"),
        (OLD, "would compute other numbers: mujoco 3.3.0 there, .* here: make all machines alike"),
        (EDITED, "would compute other numbers: law 0123 there, .* here"),
        (OTHER_PYTHON, "would compute other numbers: python 3.99 there, .* here"),
    ],
)
def test_a_worker_is_asked_before_it_computes(scheduler, code, said):
    _, client, worker = scheduler
    worker()
    worker(code)
    with pytest.raises(trainmj.InputError, match=rf"^worker tcp://\S+: {said}"):
        trainmj.cases.cluster.engine(client, trainmj.load("b_type"))


def sweep_until(tmp_path, client, act):
    """Sweep on a cluster to which something happens when the first cases are there: how many are kept, what is said."""
    from trainmj.cases.cluster import engine

    sweep = trainmj.grid_of(trainmj.load("b_type", {"simulation.step_ms": 0.5}), MANY)
    acted = []

    def progress(finished):
        if finished and not acted:
            acted.append(act())

    with pytest.raises(trainmj.TrainmjError) as raised:
        trainmj.run_sweep(sweep, tmp_path, engine=engine(client, sweep.scenario, 3.0), progress=progress)
    return len(trainmj.read_table(tmp_path)), str(raised.value)


@pytest.mark.thorough
@pytest.mark.parametrize("code", [OLD, EDITED])
def test_a_worker_that_comes_later_is_asked_before_its_numbers_are_kept(scheduler, tmp_path, code):
    _, client, worker = scheduler
    worker()
    kept, said = sweep_until(tmp_path, client, lambda: worker(f"{code}; import trainmj.collision.summary", wait=False))
    assert "would compute other numbers" in said
    assert 0 < kept < 3000


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("number", "said"), [(signal.SIGKILL, "no worker is left"), (signal.SIGSTOP, "does not answer (no answer in 3 s)")]
)
def test_workers_that_are_gone_or_hang_end_a_sweep_in_one_message(scheduler, tmp_path, number, said):
    _, client, worker = scheduler
    process = worker()
    kept, message = sweep_until(tmp_path, client, lambda: process.send_signal(number))
    assert said in message
    assert message.endswith("finished cases are kept: the same command goes on")
    assert 0 < kept < 3000


@pytest.mark.thorough
def test_a_worker_that_hangs_from_the_start_is_named(scheduler):
    _, client, worker = scheduler
    process = worker()
    process.send_signal(signal.SIGSTOP)
    with pytest.raises(trainmj.InputError, match=r"^worker tcp://\S+: does not answer \(no answer in 3 s\): stop it"):
        trainmj.cases.cluster.engine(client, trainmj.load("b_type"))


@pytest.mark.thorough
def test_a_scheduler_without_workers_is_said(scheduler, tmp_path):
    address = scheduler[0].scheduler_address
    done = trainmj_sweep("b_type", *CASES, "--out", tmp_path, "--dask", address)
    assert said_no(done, f"the scheduler {address} has no workers: start some first")


@pytest.mark.thorough
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_scheduler_that_is_gone_or_hangs_ends_a_sweep_in_one_message(tmp_path, number):
    out, place = tmp_path / "out", tmp_path / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    words = [*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", place]
    scheduler = subprocess.Popen(words, **quiet)
    wait_for(place.exists)
    address = json.loads(place.read_text())["address"]
    worker = subprocess.Popen([*dask, "worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"], **quiet)
    try:
        words = ["sweep", "b_type", "--vary", "mass_t=30:36:3000", "--out", out, "--dask", address]
        sweep = subprocess.Popen([sys.executable, "-m", "trainmj", *words], stderr=subprocess.PIPE, text=True)
        wait_for(lambda: _finished(out / "results.sqlite"))
        scheduler.send_signal(number)
        _, said = sweep.communicate(timeout=120)
    finally:
        for process in (scheduler, worker):
            process.kill()
            process.wait()
    assert sweep.returncode == 2, said
    assert said.startswith(f"Error: the cluster {address} failed (")
    assert said.endswith("finished cases are kept: the same command goes on\n")
    assert said.count("\n") == 1


@pytest.mark.thorough
def test_ctrl_c_at_the_terminal_reaches_no_local_worker(tmp_path):
    """Breaks if each worker prints a traceback of its own, or stays behind."""
    words = ["sweep", "b_type", "--vary", "mass_t=30:36:3000", "--out", tmp_path, "--dask", "local"]
    command = [sys.executable, "-m", "trainmj", *words]
    sweep = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    wait_for(lambda: _finished(tmp_path / "results.sqlite"))
    os.killpg(sweep.pid, signal.SIGINT)
    _, said = sweep.communicate(timeout=60)
    assert sweep.returncode == 130
    assert said == f"Stopped. What was finished is in {tmp_path}; the same command goes on.\n"


@pytest.mark.thorough
@pytest.mark.skipif(not Path("/proc/self/net/tcp").exists(), reason="asks Linux")
def test_nothing_listens_while_a_local_worker_computes(tmp_path):
    """Breaks if another user of the machine can hand it code, or look at a dashboard."""
    with socket.create_server(("127.0.0.1", 0)):
        assert listening(os.getpid()), "what listens is seen"
    words = ["sweep", "b_type", "--vary", "mass_t=30:36:300", "--out", tmp_path, "--dask", "local"]
    sweep = subprocess.Popen([sys.executable, "-m", "trainmj", *words], stderr=subprocess.PIPE, text=True)
    found, looks = set(), 0
    while sweep.poll() is None:
        with contextlib.suppress(OSError):  # it is gone, or closes a file
            found |= listening(sweep.pid)
            looks += bool(_finished(tmp_path / "results.sqlite"))
        time.sleep(0.002)
    assert sweep.returncode == 0, sweep.stderr.read()
    assert looks > 2, "it was looked at while it computed"
    assert not found


def listening(process):
    """The ports at which a process listens, by what Linux says of its sockets."""
    folder = Path(f"/proc/{process}")
    own = set()
    for file in os.listdir(folder / "fd"):
        with contextlib.suppress(OSError):  # closed meanwhile
            own.add(os.readlink(folder / "fd" / file))
    lines = [line.split() for name in ("tcp", "tcp6") for line in (folder / "net" / name).read_text().splitlines()[1:]]
    return {
        int(at.split(":")[1], 16)
        for _, at, _, state, *_, node in (line[:10] for line in lines)
        if state == "0A" and f"socket:[{node}]" in own
    }


def wait_for(there):
    until = time.monotonic() + 60
    while not there():
        assert time.monotonic() < until, "waited in vain"
        time.sleep(0.05)
