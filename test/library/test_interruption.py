"""Ctrl-C in calls of the library that would take hours, and in threads of theirs."""

import signal
import subprocess
import sys
import textwrap
import threading
import time

import psutil
import pytest

from sbs_sim import simulate_batch
from sbs_sim.analysis.batch import Case
from sbs_sim.concurrency import interruption
from sbs_sim.concurrency.interruption import InterruptedCallError
from sbs_sim.concurrency.parallel import Execution, compute

PATIENCE = 60.0  # s, generous, for machines that are busy
CODE = """
    import signal
    import threading
    import numpy as np
    from sbs_sim import Aircraft, Case, simulate, simulate_batch, sweep

    aircraft = Aircraft.load("sbs").with_values({"environment.air_density": 0.0, "environment.gravity": 0.0})
    at_rest = np.zeros(aircraft.layout.size)
    at_rest[3] = 1.0
    pull = [0.1, 0.0, 0.0, 0.0]
    calls = {
        "simulate": lambda: simulate(aircraft, at_rest, pull, 1e4),
        "a long tick": lambda: simulate(aircraft, at_rest, pull, 1e5, tick=1.0, azimuth_step=0.026),
        "batch": lambda: simulate_batch(
            [Case(aircraft, at_rest, pull)] * 50, 1e6, workers=2, every=10**8, outputs=["u"]
        ),
        "sweep": lambda: sweep(Aircraft.load("sbs"), "airspeed", np.linspace(0.0, 20.0, 100_000), workers=2),
    }
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in what a script starts in the background
    print("started", flush=True)
    try:
        calls[CALL]()
    except KeyboardInterrupt:
        print("interrupted", [thread.name for thread in threading.enumerate()])
"""


@pytest.mark.parametrize("call", ["simulate", "a long tick", "batch", "sweep"])
def test_ctrl_c_ends_what_would_take_hours(call):
    code = textwrap.dedent(CODE).replace("CALL", repr(call))
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "started\n"
        watched, end = psutil.Process(process.pid), time.monotonic() + PATIENCE
        before = watched.cpu_times().user
        while watched.cpu_times().user < before + 0.3:  # it is at work
            assert time.monotonic() < end
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        try:
            out, _ = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
    assert out == "interrupted ['MainThread']\n"


IN_A_CALLBACK = """
    import signal
    import sys
    from sbs_sim import Aircraft, trim

    def look(frame, event, _):
        if event == "call" and frame.f_code.co_name.startswith("_raw_object_cache"):
            sys.setprofile(None)
            print("asked", flush=True)
            signal.raise_signal(signal.SIGINT)

    aircraft = Aircraft.load("sbs")
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.setprofile(look)
    try:
        trim(aircraft)
    except KeyboardInterrupt:
        print("interrupted", signal.getsignal(signal.SIGINT) is signal.default_int_handler)
"""


def test_ctrl_c_is_not_lost_while_machine_code_is_loaded():
    """Python would drop it in LLVM's calls back, and the call would go on to its end."""
    code = [sys.executable, "-c", textwrap.dedent(IN_A_CALLBACK)]
    ended = subprocess.run(code, capture_output=True, text=True, timeout=PATIENCE, check=True)
    assert ended.stdout == "asked\ninterrupted True\n"


def test_calls_at_work_end_where_they_look_and_those_that_wait_do_not_begin(sbs):
    started, ended = [], []

    def work(_, number):
        started.append(number)
        try:
            while True:
                interruption.look()
                time.sleep(0.001)
        except InterruptedCallError:
            ended.append(number)
            raise

    def asked():
        if len(started) == 2:
            raise KeyboardInterrupt
        return False

    with pytest.raises(KeyboardInterrupt):
        compute(work, [(sbs, i) for i in range(5)], lambda *_: None, Execution(cancelled=asked), 2)
    assert sorted(started) == sorted(ended) == [0, 1]


def test_a_thread_whose_start_is_interrupted_ends_too(sbs, monkeypatch):
    """Ctrl-C while the executor waits for its second thread to start, of which it then knows nothing."""
    start = threading.Thread.start

    def interrupted(thread):
        start(thread)
        if thread.name.startswith("sbs_sim") and thread.name.endswith("_1"):
            raise KeyboardInterrupt

    def work(_):
        while True:
            interruption.look()
            time.sleep(0.001)

    monkeypatch.setattr(threading.Thread, "start", interrupted)
    with pytest.raises(KeyboardInterrupt):
        compute(work, [(sbs,)] * 5, lambda *_: None, Execution(), 2)
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("sbs_sim")]


def test_an_error_of_the_caller_ends_the_flights_too(sbs, hover):
    def progress(*_):
        raise RuntimeError("of the caller")

    with pytest.raises(RuntimeError, match="of the caller"):
        simulate_batch([Case(sbs, hover), *[Case(sbs, hover)] * 20], 0.05, workers=2, progress=progress)
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("sbs_sim")]


def test_nobody_is_interrupted_without_being_asked():
    interruption.look()
    asked = threading.Event()
    assert interruption.until(asked, lambda value: (interruption.look(), value)[1], 5) == 5
    asked.set()
    with pytest.raises(InterruptedCallError):
        interruption.until(asked, interruption.look)
    interruption.look()
