"""The templates of the pages: one look, no network, nothing undefined."""

from __future__ import annotations

from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from factorlab.typography import bound

__all__ = ["fill"]


def fill(template: str, **values: Any) -> str:
    """A page as text; every template extends `page.html.j2`, which holds the style."""
    environment = Environment(
        loader=PackageLoader("factorlab", "report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_bound if values.get("lang") == "fr" else None,
    )
    return environment.get_template(template).render(**values)


def _bound(value: Any) -> Any:
    """Words of a French page; drawings and numbers stay as they are."""
    return bound(value) if type(value) is str else value
