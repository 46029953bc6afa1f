"""The command line."""

from rebody.cli.main import main

__all__ = ["main"]
