from workflow.conftest import finished, place  # noqa: F401
