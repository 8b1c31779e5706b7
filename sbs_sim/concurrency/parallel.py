"""Independent calls side by side: in threads on the cores of this machine, or on the workers of a dask cluster."""

import itertools
import os
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Protocol

from sbs_sim import checks
from sbs_sim.concurrency.interruption import until
from sbs_sim.errors import ClusterError, SbsError

if TYPE_CHECKING:
    import distributed

    from sbs_sim.aircraft import Aircraft

MAX_WORKERS = 256
_NUMBERS = itertools.count()  # of the pools of this process
POLL_PERIOD = 0.05  # s between looks whether the caller wants to go on


@dataclass(frozen=True)
class Execution:
    """Who makes many calls, who hears of their progress, and who may end them.

    Parameters
    ----------
    workers : int, optional
        Number of threads, one for each core if not given. Not with a cluster.
    progress : callable, optional
        Called in the calling thread as each call ends; the last two arguments are the numbers of calls done and of all.
    cancelled : callable, optional
        Asked several times a second; after a True no further call is started.
    dask : str or distributed.Client, optional
        Address of the scheduler of a cluster, which then takes the calls in place of threads. Calls of a worker that
        is lost are made again.
    """

    workers: int | None = None
    progress: Callable[..., None] | None = None
    cancelled: Callable[[], bool] | None = None
    dask: "str | distributed.Client | None" = None

    def threads(self, error: type[SbsError]) -> int:
        """Number of threads.

        Raises
        ------
        error
            `workers` is no integer in the range, or there is a cluster.
        """
        workers = self.workers
        if workers is None:
            return len(os.sched_getaffinity(0))
        if self.dask is not None:
            shown = checks.shown(workers)
            raise error(f"workers = {shown}: not allowed with dask, whose workers are those of the cluster")
        return checks.integer("workers", workers, 1, MAX_WORKERS, error)


class Pool(Protocol):
    """What executes calls; its futures are those of `concurrent.futures`, or answer alike."""

    def submit(self, function: Callable[..., Any], aircraft: "Aircraft", *arguments: Any) -> Any:
        """Begin a call when its turn comes; the future of its result."""

    def result(self, future: Any) -> Any:
        """What a call that has ended gives."""

    def cancel(self, futures: Sequence[Any]) -> None:
        """Begin none of these calls any more."""


def compute(
    function: Callable[..., Any],
    calls: Sequence[tuple[Any, ...]],
    keep: Callable[[int, Any], None],
    execution: Execution,
    threads: int,
) -> None:
    """Call a function with each of many arguments, in any order; an interruption (Ctrl-C) ends all of them soon.

    Parameters
    ----------
    function : callable
        Of a module of this package; depends on its arguments alone.
    calls : sequence of tuples
        Arguments of each call, an `Aircraft` the first.
    keep : callable
        Called with the number of a call and its result, in the calling thread, as each ends.
    execution : Execution
    threads : int
        `Execution.threads`, checked by the caller before it made the calls.

    Raises
    ------
    ClusterError
        The cluster cannot be reached, or does not give what this process would.
    """
    cancelled = execution.cancelled
    with _pool(threads, execution.dask) as pool:
        ended: SimpleQueue[int] = SimpleQueue()
        waiting = {i: pool.submit(function, *call) for i, call in enumerate(calls)}
        for i, future in waiting.items():
            future.add_done_callback(partial(_tell, ended, i))  # at once, if it has ended already
        stopped = False
        try:
            for i in _as_they_end(ended, len(waiting)):
                future = waiting.pop(i) if i is not None else None
                if future is not None and future.cancelled():
                    if not stopped:  # only a cluster drops what nobody has cancelled
                        raise ClusterError("dask: the connection to the cluster is lost")
                elif future is not None:
                    keep(i, pool.result(future))
                if not stopped and cancelled is not None and cancelled():
                    stopped = True
                    pool.cancel(list(waiting.values()))
        finally:
            pool.cancel(list(waiting.values()))


def _tell(ended: "SimpleQueue[int]", i: int, _: Any) -> None:
    ended.put(i)


def _as_they_end(ended: "SimpleQueue[int]", count: int) -> Iterator[Any]:
    """Numbers of the calls as they end; None at times between."""
    while count:
        try:
            yield ended.get(timeout=POLL_PERIOD)
        except Empty:
            yield None
        else:
            count -= 1


def _pool(workers: int, dask: "str | distributed.Client | None") -> AbstractContextManager[Pool]:
    if dask is None:
        return _threads(workers)
    from sbs_sim.concurrency.cluster import cluster

    return cluster(dask)


@contextmanager
def _threads(workers: int) -> Iterator["Threads"]:
    name, stop = f"sbs_sim_{next(_NUMBERS)}", threading.Event()
    executor = ThreadPoolExecutor(workers, thread_name_prefix=name)
    try:
        yield Threads(executor, stop)
    finally:
        stop.set()  # what is still at work then was interrupted
        executor.shutdown(cancel_futures=True)
        for thread in threading.enumerate():  # one whose start was interrupted is unknown to the executor
            if thread.name.startswith(f"{name}_"):
                thread.join()


class Threads:
    """Threads of this process: compiled code does not hold the lock that they share.

    Parameters
    ----------
    executor : ThreadPoolExecutor
    stop : threading.Event
        Set when nobody waits for the calls any more; those at work end where they look next.
    """

    def __init__(self, executor: ThreadPoolExecutor, stop: threading.Event) -> None:
        self._executor, self._stop = executor, stop

    def submit(self, function: Callable[..., Any], aircraft: "Aircraft", *arguments: Any) -> Future[Any]:
        """Begin a call when a thread is free."""
        return self._executor.submit(until, self._stop, function, aircraft, *arguments)

    def result(self, future: Future[Any]) -> Any:
        """What a call has given, or raised."""
        return future.result()

    def cancel(self, futures: Iterable[Future[Any]]) -> None:
        """Begin none of these; does nothing to those that are at work."""
        for future in futures:
            future.cancel()
