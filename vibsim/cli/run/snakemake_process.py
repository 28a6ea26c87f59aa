"""Snakemake as a child of a run: it tells the run what it does, ends with it, and at once when it is told to.

What it does goes through a pipe to the run, one JSON object a line (`LogHandler`, a logger plug-in of Snakemake). Its
own handler of SIGTERM takes a lock that the interrupted thread may hold, and then waits for ever; nothing is lost when
it is killed instead, since every file appears whole.
"""

import gc
import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from logging import LogRecord

from snakemake_interface_executor_plugins.registry import ExecutorPluginRegistry
from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.registry import LoggerPluginRegistry
from snakemake_interface_logger_plugins.settings import LogHandlerSettingsBase
from snakemake_interface_report_plugins.registry import ReportPluginRegistry

from vibsim.cli import YOUNG_OBJECTS, supervise
from vibsim.cli.run import remote
from vibsim.core.processes import end_with

FIELDS = {
    LogEvent.RUN_INFO: ("stats",),
    LogEvent.PROGRESS: ("done", "total"),
    LogEvent.JOB_INFO: ("rule_name", "output", "log", "reason"),
    LogEvent.JOB_ERROR: ("rule_name", "output", "log", "rule_msg"),
    LogEvent.ERROR: ("exception", "msg"),
}
"""The events that a run follows, each with what it needs to know of it."""


@dataclass
class LogHandlerSettings(LogHandlerSettingsBase):
    """The option ``--logger-vibsim-pipe`` of Snakemake."""

    pipe: int = field(default=-1, metadata={"help": "descriptor that events are written to"})


class LogHandler(LogHandlerBase):
    """Writes events to the pipe; what people read goes to stderr as ever."""

    writes_to_stream = False
    writes_to_file = False
    has_filter = True
    has_formatter = True
    needs_rulegraph = False
    settings: LogHandlerSettings

    def emit(self, record: LogRecord) -> None:
        """Write the event of a record, if it has one that a run follows."""
        event = getattr(record, "event", None)
        if event in FIELDS:
            content = {"event": event, **{name: getattr(record, name) for name in FIELDS[event]}}
            os.write(self.settings.pipe, f"{json.dumps(content)}\n".encode())


def main() -> None:
    """Run Snakemake for the process that the first argument names; the second says where jobs run, others follow."""
    parent, where = int(sys.argv.pop(1)), sys.argv.pop(1)
    if where == "remote":
        supervise.end_in_order()
    else:
        supervise.end_at_once()
    end_with(parent)
    gc.set_threshold(YOUNG_OBJECTS)
    # Snakemake imports every executor that is installed. That for SLURM takes half a second and needs pandas.
    if where == "remote":
        ExecutorPluginRegistry()
        remote.ask_by_age()
        remote.cancel_all()
        remote.tell_reasons()
        remote.report_submissions()
    else:
        ExecutorPluginRegistry.module_prefix = "none of them"
    # It starts in half the time without what no run of vibsim uses: numbers of NumPy in a profile, addresses in the
    # web, reports of its own, and tables as parameters of rules.
    with _absent("numpy", "requests", "snakemake.report"):
        for name in ("smart_open", "yte"):
            import_module(name)
        ReportPluginRegistry()
    with _absent("pandas"):
        from snakemake.cli import main as snakemake

        module = sys.modules[__name__]
        LoggerPluginRegistry().register_plugin("snakemake_logger_plugin_vibsim", module)
        snakemake()


@contextmanager
def _absent(*names: str) -> Iterator[None]:
    """Have modules count as not installed, as Python marks them, unless they are there already."""
    names = tuple(name for name in names if name not in sys.modules)
    sys.modules.update(dict.fromkeys(names))  # type: ignore[arg-type]
    try:
        yield
    finally:
        for name in names:
            del sys.modules[name]


if __name__ == "__main__":
    main()
