"""The templates of the pages: one look, no network, nothing undefined."""

from __future__ import annotations

from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

__all__ = ["fill"]


def fill(template: str, **values: Any) -> str:
    """A page as text; every template extends `page.html.j2`, which holds the style."""
    environment = Environment(
        loader=PackageLoader("factorlab", "report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render(**values)
