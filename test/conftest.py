"""Fixtures of the physics tests: the aircraft that come with the package and their hovers."""

import signal

import pytest
from hypothesis import settings

INTERRUPTIONS = {
    signal.SIGINT: signal.default_int_handler,
    signal.SIGTERM: signal.SIG_DFL,
    signal.SIGHUP: signal.SIG_DFL,
}
# What a script starts in the background ignores Ctrl-C, and under nohup SIGHUP; and so would every process that the
# tests start and interrupt.
for number, default in INTERRUPTIONS.items():
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, default)

# How long one example takes says more about the machine than about the code.
settings.register_profile("no_deadline", deadline=None)
settings.load_profile("no_deadline")


def pytest_collection_modifyitems(items):
    """The files whose tests wait for processes and their discovery first: at the end nobody should wait for them."""
    items.sort(key=lambda item: not hasattr(item.module, "DOMAINS"))


@pytest.fixture(autouse=True)
def _no_interruption_is_ignored():
    """What a test ignores, the processes of all later tests would ignore: they inherit it."""
    before = {number: signal.getsignal(number) for number in INTERRUPTIONS}
    yield
    ignored = [number for number in INTERRUPTIONS if signal.getsignal(number) is signal.SIG_IGN]
    for number, handler in before.items():
        signal.signal(number, handler)
    assert ignored == []


@pytest.fixture(scope="session")
def sbs():
    """The aircraft to fly."""
    from sbs_sim import Aircraft

    return Aircraft.load("sbs")


@pytest.fixture(scope="session")
def sbs_paper():
    """The aircraft in the paper's reading."""
    from sbs_sim import Aircraft

    return Aircraft.load("sbs_paper")


@pytest.fixture(scope="session")
def hover(sbs):
    """Hover trim of `sbs`."""
    from sbs_sim import trim

    return trim(sbs)


@pytest.fixture(scope="session")
def paper_hover(sbs_paper):
    """Hover trim of `sbs_paper`."""
    from sbs_sim import trim

    return trim(sbs_paper)
