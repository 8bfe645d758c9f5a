"""The self-contained page, the same numbers as JSON, and the trajectories.

report.html             one file: inline styles and figures, no script, no network
report.json             the document that --json prints, and the names of the files
trajectories/NAME.tum   one for each estimator; evo reads them
"""

from factorlab.report.writing import write_report

__all__ = ["write_report"]
