"""Graphs, comparisons, reports and the command line; sees everything, and nothing sees it.

The rooms are imported by name, so that `import factorlab` stays light:

- `factorlab.datasets` names become logs with a model that fits
- `factorlab.compare`  many estimators, one log, one table
- `factorlab.graph`    the same declaration as a factor graph
- `factorlab.report`   the self-contained page
- `factorlab.cli`      the command line
"""

__all__: list[str] = []
