"""One HTML page of runs and results that needs no network."""

from rebody.report.page.find import EXPECTED, Found, find
from rebody.report.page.page import write_page

__all__ = ["EXPECTED", "Found", "find", "write_page"]
