"""Put what a run needs beside the package into the wheel: the rest of the build is in pyproject.toml."""

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py


class BuildWithWorkflow(build_py):
    """Copy the workflow and the shipped experiments to ``vibsim/shipped``; a checkout uses its own."""

    def run(self) -> None:
        """Build the package, and put the files into it unless it is used from its checkout."""
        super().run()
        if self.editable_mode:
            return
        target = Path(self.build_lib) / "vibsim" / "shipped"
        shutil.rmtree(target, ignore_errors=True)
        target.mkdir(parents=True)
        root, unused = Path(__file__).parent, shutil.ignore_patterns("*.py", "__pycache__")
        shutil.copy(root / "Snakefile", target)
        for name in ("configs", "workflow"):
            shutil.copytree(root / name, target / name, ignore=unused)


setup(cmdclass={"build_py": BuildWithWorkflow})
