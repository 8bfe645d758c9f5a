"""What the course's examples claim, gathered: run them, judge them, write RESULTATS.md, compare with it."""

from factorlab.l19.results.claims import Claim, read_claims
from factorlab.l19.results.comparing import differences, stale_readme
from factorlab.l19.results.course import COURSE, Item, item_of
from factorlab.l19.results.page import Work, results_page
from factorlab.l19.results.reading import Row, read_results
from factorlab.l19.results.readme import readme_table, with_table
from factorlab.l19.results.running import Outcome, run_scripts, scripts_of
from factorlab.l19.results.writing import write_results

__all__ = [
    "COURSE",
    "Claim",
    "Item",
    "Outcome",
    "Row",
    "Work",
    "differences",
    "item_of",
    "read_claims",
    "read_results",
    "readme_table",
    "results_page",
    "run_scripts",
    "scripts_of",
    "stale_readme",
    "with_table",
    "write_results",
]
