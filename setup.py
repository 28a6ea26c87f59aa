"""Put what a run needs beside the package into the wheel: the rest of the build is in pyproject.toml."""

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

SHIPPED = ("Snakefile", "configs", "workflow")


class BuildWithWorkflow(build_py):
    """Copy the workflow and the shipped experiments to ``vibsim/shipped``; a checkout uses its own."""

    def run(self) -> None:
        """Build the package, and put the files into it unless it is used from its checkout."""
        super().run()
        if self.editable_mode:
            return
        target = Path(self.build_lib) / "vibsim" / "shipped"
        shutil.rmtree(target, ignore_errors=True)
        for name in SHIPPED:
            source = Path(__file__).parent / name
            if source.is_dir():
                shutil.copytree(
                    source, target / name, ignore=shutil.ignore_patterns("*.py", "__pycache__")
                )
            else:
                target.mkdir(parents=True, exist_ok=True)
                shutil.copy(source, target / name)


setup(cmdclass={"build_py": BuildWithWorkflow})
