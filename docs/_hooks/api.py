"""The API reference: a page for every package, made while the site is built: none can be forgotten."""

import ast
from pathlib import Path

from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("sequential", "vision3d", "factorlab")
# the command line has its own reference; kernels are called by estimators only
HIDDEN = ("factorlab.cli", "sequential.kernels", "vision3d.kernels")


def on_config(config):
    """Put the pages into the navigation, a section for each distribution package."""
    sections = [{root: [{name: place(name)} for name in rooms(root)]} for root in PACKAGES]
    config.nav.append({"API": ["api/index.md", *sections]})
    return config


def on_files(files, config):
    """Write the pages."""
    for root in PACKAGES:
        for name in rooms(root):
            files.append(File.generated(config, place(name), content=page(name)))
    files.append(File.generated(config, "api/index.md", content=overview()))
    return files


def place(name):
    """Where the page of a package lies."""
    return f"api/{name}.md"


def rooms(root):
    """The packages under a root, by their dotted names."""
    inits = sorted((ROOT / root).rglob("__init__.py"), key=lambda init: init.parent.parts)
    names = [".".join(init.parent.relative_to(ROOT).parts) for init in inits]
    return [name for name in names if not name.startswith(HIDDEN)]


def page(name):
    """A package: its docstring and what it exports; a root and a room without exports: its modules."""
    own = exported(ROOT.joinpath(*name.split("."), "__init__.py"))
    lines = [f"# {name}", ""]
    if own and name not in PACKAGES:
        return "\n".join([*lines, f"::: {name}"])
    lines += [f"::: {name}", "    options:", "      members: false", ""]
    for module in modules(name):
        lines += [f"## {module}", "", f"::: {module}", "    options:", "      heading_level: 3", ""]
    return "\n".join(lines)


def modules(name):
    """The modules of a package that say what they offer."""
    files = sorted(ROOT.joinpath(*name.split(".")).glob("*.py"))
    return [f"{name}.{file.stem}" for file in files if not file.stem.startswith("_") and exported(file)]


def exported(file):
    """The names in a module's `__all__`."""
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        if any(isinstance(target, ast.Name) and target.id == "__all__" for target in targets):
            return ast.literal_eval(node.value)
    return []


def overview():
    """The first page: every package with the first line of its docstring."""
    lines = ["# API reference", "", "Imports go one way: `factorlab` to `vision3d` to `sequential`.", ""]
    for root in PACKAGES:
        lines += [f"## {root}", "", "| package | what is in it |", "|---|---|"]
        lines += [f"| [{name}]({name}.md) | {first_line(name)} |" for name in rooms(root)]
        lines.append("")
    return "\n".join(lines)


def first_line(name):
    """The first line of a package's docstring."""
    init = ROOT.joinpath(*name.split("."), "__init__.py")
    return (ast.get_docstring(ast.parse(init.read_text(encoding="utf-8"))) or "").split("\n", 1)[0]
