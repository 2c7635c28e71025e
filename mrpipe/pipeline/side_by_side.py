"""Builds stages that do not need each other at the same time, in processes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from multiprocessing.connection import wait
from typing import TYPE_CHECKING

from mrpipe.pipeline.execution import Order, Outcome, StageRunner
from mrpipe.pipeline.progress import StageBars
from mrpipe.pipeline.stage_process import Done, Failed, Share, StageProcess

if TYPE_CHECKING:
    from mrpipe.pipeline.runner import Pipeline

AT_A_TIME = 2
"""Stages that run at the same time. Most of them use all processors for a part of their time only; with more of them,
memory would limit before processors do."""


def build_side_by_side(
    pipeline: Pipeline,
    names: Sequence[str],
    make_runner: Callable[[], StageRunner],
    one_processor_is_busy: Callable[[], bool] = lambda: False,
) -> None:
    """Bring stages and everything that they need up to date, with up to two stages at the same time.

    Results do not depend on it, because a stage starts after all that it may read. Until two stages can run together,
    they run in this process. With one process only, one stage runs after the other.

    Parameters
    ----------
    pipeline
        Takes the outcomes.
    names
        Stages.
    make_runner
        Returns what runs a stage, in another process.
    one_processor_is_busy
        Returns whether something else needs a processor, so that one stage at a time is enough.

    Raises
    ------
    MrpipeError
        If a stage fails and the pipeline does not keep going.
    """
    if pipeline.jobs == 1:
        for name in names:
            pipeline.build(name)
        return
    with _Crew(pipeline, make_runner) as crew:
        waiting = _Waiting(pipeline, names)
        while waiting.names or crew.running:
            at_a_time = 1 if one_processor_is_busy() else AT_A_TIME
            orders = waiting.orders(at_a_time - len(crew.running), crew.running_names)
            if len(orders) == 1 and crew.is_empty:
                alone = orders[0]
                pipeline.finish(alone, lambda order=alone: pipeline.runner.run(order))  # type: ignore[misc]
                continue
            for order in orders:
                crew.start(order)
            crew.wait()
    in_order = list(pipeline.stages)
    pipeline.outcomes = dict(sorted(pipeline.outcomes.items(), key=lambda item: in_order.index(item[0])))


class _Waiting:
    """Stages that have not begun; those that most others wait for come first."""

    def __init__(self, pipeline: Pipeline, names: Sequence[str]) -> None:
        self._pipeline = pipeline
        planned = pipeline.plan(names)
        self._before = {name: pipeline.waits_for(name) & set(planned) for name in planned}
        self.names = sorted(planned, key=lambda name: -len(self._after(name)))

    def _after(self, name: str) -> set[str]:
        found: set[str] = set()
        new = {name}
        while new:
            new = {other for other, before in self._before.items() if before & new} - found
            found |= new
        return found

    def orders(self, most: int, running: Sequence[str]) -> list[Order]:
        """Return up to `most` orders; stages that are up to date, skipped or failed need none."""
        orders: list[Order] = []
        while len(orders) < most:
            busy = {*running, *(order.stage for order in orders), *self.names}
            ready = next((name for name in self.names if not self._before[name] & busy), None)
            if ready is None:
                break
            self.names.remove(ready)
            begun = self._pipeline.begin(ready)
            if not isinstance(begun, Outcome):
                orders.append(begun)
        return orders


class _Crew:
    """The processes, and the stages that they run."""

    def __init__(self, pipeline: Pipeline, make_runner: Callable[[], StageRunner]) -> None:
        self._pipeline = pipeline
        self._make_runner = make_runner
        self._idle: list[StageProcess] = []
        self.running: dict[StageProcess, Order] = {}
        self._bars = StageBars(pipeline.quiet)

    @property
    def running_names(self) -> list[str]:
        return [order.stage for order in self.running.values()]

    @property
    def is_empty(self) -> bool:
        """Whether no process has been started."""
        return not self.running and not self._idle

    def start(self, order: Order) -> None:
        """Run a stage in the idle process that has loaded most of its modules, or in a new one."""
        idle = [process for process in self._idle if process.alive]
        process = max(idle, key=lambda item: item.loaded(order)) if idle else StageProcess(self._make_runner)
        self._idle = [item for item in idle if item is not process]
        self.running[process] = order
        process.start(order)
        self._bars.update(order.stage, 0.0)

    def wait(self) -> None:
        """Wait for messages and pass them on; return at once where nothing runs."""
        by_connection = {process.connection: process for process in self.running}
        for connection in wait(list(by_connection)) if by_connection else []:
            process = by_connection[connection]  # type: ignore[index]
            order, message = self.running[process], process.receive()
            if isinstance(message, Share):
                self._bars.update(order.stage, message.fraction, message.text)
            elif isinstance(message, Done | Failed):
                self._bars.remove(order.stage)
                del self.running[process]
                if process.alive:
                    self._idle.append(process)
                self._pipeline.finish(order, lambda message=message: self._result(message))  # type: ignore[misc]
            else:
                self._pipeline.logger.handle(message)

    def _result(self, message: Done | Failed) -> Outcome:
        if isinstance(message, Failed):
            raise message.error
        self._pipeline.hashes.learn(message.digests)
        return message.outcome

    def __enter__(self) -> _Crew:
        return self

    def __exit__(self, *error: object) -> None:
        with ExitStack() as stack:
            stack.callback(self._bars.close)
            for process in (*self._idle, *self.running):
                stack.callback(process.end, at_once=bool(self.running))
