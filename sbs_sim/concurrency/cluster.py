"""Calls on a dask cluster: aircraft travel as data, and workers that would give other bits are refused."""

import functools
import importlib.metadata
import pickle
import socket
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import ClusterError, SbsError
from sbs_sim.versions import in_words, source_digest, versions

if TYPE_CHECKING:
    import distributed

PATIENCE = 10.0  # s, for the scheduler's answer and for the first worker
SOURCES = ("*.py", "analysis/*.py", "model/*.py")


@contextmanager
def cluster(dask: "str | distributed.Client") -> Iterator["Cluster"]:
    """A cluster by the address of its scheduler, or a client that is connected to one and stays so.

    Raises
    ------
    ClusterError
        dask.distributed is not installed, nobody answers there, or there is no worker; what goes wrong there later.
    """
    try:
        import distributed
    except ImportError as error:
        raise ClusterError(f"dask = {dask!r}: needs dask.distributed: pip install distributed ({error})") from None
    client = dask if isinstance(dask, distributed.Client) else _client(dask)
    try:
        with _told_in_one_line():
            client.wait_for_workers(1, timeout=PATIENCE)
        yield Cluster(client)
    finally:
        if client is not dask:
            client.close()


@contextmanager
def _told_in_one_line() -> Iterator[None]:
    """What goes wrong with workers or connections is of all kinds."""
    try:
        yield
    except SbsError:
        raise
    except Exception as error:
        text = " ".join(str(error).split())
        raise ClusterError(f"dask: {type(error).__name__}: {text}") from error


def _client(address: str) -> "distributed.Client":
    import distributed

    try:
        host, port = distributed.comm.get_address_host_port(address)
        socket.create_connection((host, port), PATIENCE).close()  # a client that has not found anybody ends badly
        return distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except Exception:  # of all kinds, where something else than a scheduler answers
        raise ClusterError(f"dask = {address!r}: no scheduler answers there; allowed are tcp://HOST:PORT") from None


class Cluster:
    """Workers of a cluster."""

    def __init__(self, client: "distributed.Client") -> None:
        self._client = client
        self._here = _versions()
        self._packed: dict[
            int, tuple[Aircraft, bytes, Any]
        ] = {}  # by identity; the aircraft keeps it from being reused
        self._contents: dict[bytes, Any] = {}

    def submit(self, function: Callable[..., Any], aircraft: Aircraft, *arguments: Any) -> Any:
        """Begin a call on some worker."""
        import cloudpickle  # comes with distributed; takes a function of time that a user has written, too

        if id(aircraft) not in self._packed:
            self._packed[id(aircraft)] = (aircraft, *self._pack(aircraft))
        _, data, contents = self._packed[id(aircraft)]
        call = cloudpickle.dumps((function, aircraft.parameter_hash, arguments))
        with _told_in_one_line():
            return self._client.submit(_call, self._here, call, data, contents, pure=False)

    def result(self, future: Any) -> Any:
        """What a call has given; its memory on the cluster is free when the future is."""
        with _told_in_one_line():
            return future.result()

    def cancel(self, futures: Sequence[Any]) -> None:
        """Begin none of these, and forget those that are at work."""
        if futures:
            self._client.cancel(futures)

    def _pack(self, aircraft: Aircraft) -> tuple[bytes, Any]:
        """Mapping of an aircraft, and the files that it names: a result on the cluster, which is made anew if lost."""
        data, files = aircraft.files()
        contents = pickle.dumps(files)
        if contents not in self._contents:
            self._contents[contents] = self._client.submit(_itself, contents, pure=False)
        return pickle.dumps(data), self._contents[contents]


# --- on a worker ------------------------------------------------------------------------------------------------


def _itself(contents: bytes) -> bytes:
    return contents


def _call(there: dict[str, str], call: bytes, data: bytes, contents: bytes) -> Any:
    """Make a call, if this process gives what that one would."""
    import cloudpickle
    import distributed

    here = _versions()
    for name, version in there.items():
        if here.get(name) != version:
            worker = distributed.get_worker().address
            difference = in_words(name, version, here.get(name, ""), "where it is asked")
            raise ClusterError(f"dask: worker {worker} would give other bits: {difference}")
    function, parameter_hash, arguments = cloudpickle.loads(call)
    aircraft, _ = _unpacked(data, contents)
    if aircraft.parameter_hash != parameter_hash:
        raise ClusterError(f"dask: worker {distributed.get_worker().address} makes another aircraft of the same data")
    return function(aircraft, *arguments)


@functools.lru_cache(maxsize=64)
def _unpacked(data: bytes, contents: bytes) -> tuple[Aircraft, Any]:
    """Aircraft, and what keeps its files."""
    folder = _folder(contents)
    return Aircraft.from_dict(pickle.loads(data), Path(folder.name)), folder


@functools.lru_cache(maxsize=4)
def _folder(contents: bytes) -> "tempfile.TemporaryDirectory[str]":
    folder = tempfile.TemporaryDirectory(prefix="sbs_sim-")
    for name, content in pickle.loads(contents).items():
        (Path(folder.name) / name).write_bytes(content)
    return folder


@functools.cache
def _versions() -> dict[str, str]:
    """What decides the bits of trims, linear models and flights; the processor does not."""
    package = Path(__file__).parent
    digest = source_digest(path for pattern in SOURCES for path in package.glob(pattern))
    return {**versions(), "scipy": importlib.metadata.version("scipy"), "sources": digest}
