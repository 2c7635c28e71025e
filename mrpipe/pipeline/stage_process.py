"""A process that runs stages for the one that builds the pipeline, and what the two tell each other."""

from __future__ import annotations

import logging
import logging.handlers
import multiprocessing
import os
import pickle
import queue
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection, wait
from typing import TYPE_CHECKING, Any

from mrpipe.errors import MrpipeError
from mrpipe.pipeline.progress import shows_bars, stage_progress

if TYPE_CHECKING:
    from mrpipe.artifacts import Progress
    from mrpipe.pipeline.execution import Order, Outcome, StageRunner

_REPORT_EVERY_S = 0.2
_GRACE_S = 2.0
"""Time that a process has to end after the one that it works for has gone."""


@dataclass(frozen=True)
class Share:
    """A stage reports the share of its work that is done."""

    fraction: float
    text: str


@dataclass(frozen=True)
class Done:
    """A stage ran: its outcome, and the digests of the files that it wrote."""

    outcome: Outcome
    digests: Mapping[str, Any]


@dataclass(frozen=True)
class Failed:
    """A stage raised an error."""

    error: Exception


Message = logging.LogRecord | Share | Done | Failed


class StageProcess:
    """A process that runs one stage after the other.

    It is a new interpreter (`spawn`), because a copy of a process with threads may wait for a lock that nobody holds.

    Parameters
    ----------
    make_runner
        Returns what runs a stage, in the new process; it must be known to :mod:`pickle`.
    """

    def __init__(self, make_runner: Callable[[], StageRunner]) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, make_runner), name="mrpipe stages")
        self._process.start()
        theirs.close()
        self._modules: set[str] = set()

    def loaded(self, order: Order) -> int:
        """Return how many modules of a stage are loaded, because a stage before it needed them."""
        return len(self._modules & set(order.key.code))

    def start(self, order: Order) -> None:
        """Run a stage; :meth:`receive` returns what it reports.

        Raises
        ------
        OSError
            If the process has ended.
        """
        self._modules |= set(order.key.code)
        self.connection.send(order)

    def receive(self) -> Message:
        """Return the next message; wait for it.

        A process that ended without a message counts as the failure of its stage.
        """
        try:
            message: Message = self.connection.recv()
        except (EOFError, OSError):
            self._process.join(_GRACE_S)
            code = self._process.exitcode
            how = f"was ended by signal {-code}" if code is not None and code < 0 else f"ended with status {code}"
            problem = f"its process {how}; if memory is exhausted, use shorter tests, a lower rate, or --jobs 1"
            return Failed(MrpipeError(problem))
        return message

    @property
    def alive(self) -> bool:
        """Whether it can run a stage."""
        return self._process.is_alive()

    def end(self, *, at_once: bool) -> None:
        """End the process: after what it does, or at once."""
        self.connection.close()
        if at_once:
            self._process.terminate()
        self._process.join(_GRACE_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()


def _serve(connection: Connection, make_runner: Callable[[], StageRunner]) -> None:
    """Run the stages that are ordered until nobody orders any more."""
    # Ctrl-C reaches every process of a terminal; the one that ordered the stages ends this one
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    threading.Thread(target=_end_with_parent, daemon=True).start()
    wire = _Wire(connection)
    runner = make_runner()
    runner.logger.handlers = [wire]
    runner.logger.propagate = False
    runner = replace(runner, progress=wire.progress)
    while True:
        try:
            order = connection.recv()
        except (EOFError, OSError):
            return
        try:
            wire.send(Done(runner.run(order), runner.hashes.take_new()))
        except Exception as error:
            wire.send(Failed(_portable(error)))


def _end_with_parent() -> None:
    """End this process after its parent has gone, so that nothing writes into a run directory that is not locked."""
    parent = multiprocessing.parent_process()
    if parent is None:
        return
    wait([parent.sentinel])
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(_GRACE_S)
    os._exit(1)


class _Wire(logging.handlers.QueueHandler):
    """Sends log lines, progress and results; threads of a stage may use it at the same time."""

    def __init__(self, connection: Connection) -> None:
        super().__init__(queue.SimpleQueue())  # not used: `enqueue` sends
        self._connection = connection
        self._one_at_a_time = threading.Lock()

    def send(self, message: Message) -> None:
        with self._one_at_a_time, suppress(BrokenPipeError):
            self._connection.send(message)

    def enqueue(self, record: logging.LogRecord) -> None:
        self.send(record)

    @contextmanager
    def progress(self, stage: str, logger: logging.Logger, quiet: bool) -> Iterator[Progress]:
        """Yield the `progress` of a stage: messages for a bar, log lines elsewhere."""
        if not shows_bars(quiet):
            with stage_progress(stage, logger, quiet) as to_log:
                yield to_log
            return
        last = -_REPORT_EVERY_S

        def progress(fraction: float, text: str = "") -> None:
            nonlocal last
            now = time.monotonic()
            if now - last >= _REPORT_EVERY_S:
                last = now
                self.send(Share(fraction, text))

        yield progress


def _portable(error: Exception) -> Exception:
    """Return an error that another process can read, with its traceback where it is a fault of the program."""
    try:
        copy: Exception = pickle.loads(pickle.dumps(error))
        if str(copy) != str(error):
            raise ValueError("not the same error")
    except Exception:  # whatever an error of a library does when it is copied
        copy = (
            MrpipeError(str(error))
            if isinstance(error, MrpipeError)
            else RuntimeError(f"{type(error).__name__}: {error}")
        )
    if not isinstance(error, MrpipeError):
        copy.add_note("In the process of the stage:\n" + "".join(traceback.format_exception(error)))
    return copy
