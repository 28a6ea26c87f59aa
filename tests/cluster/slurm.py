"""A SLURM of two nodes on this machine, for as long as a test needs it: munge, a controller and two node daemons.

The programs come from Debian's packages. Nothing of an installed SLURM is used or changed: configuration, sockets,
ports, keys and states are in a folder of the test. There is no accounting database, so jobs are followed by ``squeue``.
Memory is enforced: a job that holds more than it asked for is killed within some seconds.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import psutil

PACKAGES = ("slurmctld", "slurmd", "slurm-client", "munge")
PROGRAMS = ("slurmctld", "slurmd", "sbatch", "srun", "scancel", "munged")
NODES = ("node1", "node2")

CONFIGURATION = """\
ClusterName=vibsim
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldPidFile={folder}/controller.pid
SlurmdPidFile={folder}/%n.pid
SlurmctldLogFile={folder}/controller.log
SlurmdLogFile={folder}/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerParameters=batch_sched_delay=1,sched_interval=2,bf_interval=5
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=task=2
JobAcctGatherParams=OverMemoryKill
AccountingStorageType=accounting_storage/none
JobRequeue=0
KillWait=5
MinJobAge=600
ReturnToService=2
SlurmdTimeout=10
"""


def missing() -> str:
    """Install what is missing; say what cannot be had, nothing where all is there."""
    if os.geteuid() != 0:
        return "needs root, for daemons that start the jobs of users"
    if all(map(shutil.which, PROGRAMS)):
        return ""
    apt = shutil.which("apt-get")
    if apt is None:
        return f"no apt-get, and not installed: {', '.join(PACKAGES)}"
    # Debian starts the daemons of a package that it installs, unless this says not to
    policy = Path("/usr/sbin/policy-rc.d")
    is_ours = not policy.exists()
    if is_ours:
        policy.write_text("#!/bin/sh\nexit 101\n")
        policy.chmod(0o755)
    try:
        for words in (["update"], ["install", "-y", "--no-install-recommends", *PACKAGES]):
            ended = subprocess.run(
                [apt, *words],
                env=os.environ | {"DEBIAN_FRONTEND": "noninteractive"},
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                check=False,
            )
            if ended.returncode:
                return f"apt-get {words[0]} failed: {ended.stderr.strip()[-300:]}"
    finally:
        if is_ours:
            policy.unlink()
    return ""


@dataclass
class Cluster:
    """The daemons that run, and how to ask them."""

    folder: Path
    daemons: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict)

    @property
    def environment(self) -> dict[str, str]:
        """The environment in which the commands of SLURM find this one."""
        path = f"{self.folder}:{os.environ['PATH']}"
        return os.environ | {"SLURM_CONF": str(self.folder / "slurm.conf"), "PATH": path}

    def ask(self, *words: str) -> str:
        """Return what a command of SLURM prints."""
        ended = subprocess.run(
            words, env=self.environment, capture_output=True, text=True, check=False, timeout=60
        )
        assert ended.returncode == 0, f"{words}: {ended.stderr}"
        return ended.stdout.strip()

    def jobs(self, state: str) -> list[str]:
        """Return the numbers of the jobs in a state, such as RUNNING, or a list of states."""
        return self.ask("squeue", "--noheader", "--states", state, "--format", "%i").split()

    def start(self, name: str, *words: str) -> None:
        """Start a daemon in the foreground, in a group of its own."""
        with (self.folder / f"{name}.out").open("wb") as text:
            self.daemons[name] = subprocess.Popen(
                words,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=text,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def start_node(self, name: str) -> None:
        """Start the daemon of a node, which has a core of its own where there are two."""
        cores = sorted(os.sched_getaffinity(0))
        core = cores[NODES.index(name) % len(cores)]
        self.start(name, "taskset", "--cpu-list", str(core), "slurmd", "-D", "-N", name)

    def stop(self, name: str, number: int = signal.SIGTERM) -> None:
        """End a daemon."""
        daemon = self.daemons.pop(name)
        daemon.send_signal(number)
        try:
            daemon.wait(10)
        except subprocess.TimeoutExpired:
            daemon.kill()
            daemon.wait()

    def fail(self, node: str) -> None:
        """Have a node fail as by a power cut: its daemon and everything that runs on it is killed."""
        self.stop(node, signal.SIGKILL)
        _kill_steps(self.folder / f"{node}.log")

    def wait(self, what: str, seconds: float = 60.0) -> None:
        """Wait until both nodes are in a state such as ``idle``."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            found = self.ask("sinfo", "--noheader", "--Node", "--format", "%T").split()
            if found == [what] * len(NODES):
                return
            time.sleep(0.5)
        logs = "\n".join(path.read_text()[-2000:] for path in self.folder.glob("*.log"))
        raise AssertionError(f"the nodes are {found}, not {what}\n{logs}")


def _kill_steps(log: Path) -> None:
    """Kill everything that runs on a node: its step daemons, which have its log open, and what they started."""
    for process in psutil.process_iter():
        with suppress(psutil.Error):
            if process.name() == "slurmstepd" and str(log) in [
                file.path for file in process.open_files()
            ]:
                for one in (*process.children(recursive=True), process):
                    one.kill()


def _free_ports(count: int) -> list[int]:
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


@contextmanager
def cluster(folder: Path, cores: int = 1, megabytes: int = 4000) -> Iterator[Cluster]:
    """Give a cluster of two nodes with so many cores and so much memory each; `folder` has a short path."""
    folder.mkdir(mode=0o755)
    (folder / "state").mkdir()
    controller, *ports = _free_ports(1 + len(NODES))
    host = socket.gethostname()
    text = CONFIGURATION.format(folder=folder, host=host, controller=controller)
    for node, port in zip(NODES, ports, strict=True):
        (folder / f"spool.{node}").mkdir()
        size = f"CPUs={cores} RealMemory={megabytes}"
        text += f"NodeName={node} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} {size}\n"
    text += f"PartitionName=main Nodes={','.join(NODES)} Default=YES MaxTime=60\n"
    (folder / "slurm.conf").write_text(text)
    # the executor takes the variables of SLURM from the environment of a job step
    srun = folder / "srun"
    srun.write_text(f'#!/bin/sh\nSLURM_CONF={folder}/slurm.conf exec {shutil.which("srun")} "$@"\n')
    srun.chmod(0o755)
    key = folder / "munge.key"
    key.write_bytes(os.urandom(128))
    key.chmod(0o400)
    made = Cluster(folder)
    try:
        made.start(
            *("munge", "munged", "--foreground", "--force", f"--key-file={key}"),
            *(f"--socket={folder}/munge.socket", f"--pid-file={folder}/munge.pid"),
            *(f"--seed-file={folder}/munge.seed", f"--log-file={folder}/munge.out"),
        )
        deadline = time.monotonic() + 20
        while not (folder / "munge.socket").exists() and time.monotonic() < deadline:
            time.sleep(0.1)
        made.start("controller", "slurmctld", "-D", "-i")
        for node in NODES:
            made.start_node(node)
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline:
            try:
                made.ask("scontrol", "ping")
                break
            except AssertionError:
                time.sleep(0.5)
        made.wait("idle")
        yield made
    finally:
        for node in NODES:
            _kill_steps(folder / f"{node}.log")
        for name in [*made.daemons][::-1]:
            made.stop(name)
