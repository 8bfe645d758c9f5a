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
    own = exported(init_of(name))
    if own and name not in PACKAGES:
        hidden = [f"::: {path}\n    options:\n      show_root_heading: true\n" for path in shadowed(name)]
        return "\n".join([f"# {name}\n\n::: {name}\n", *hidden])
    lines = [f"# {name}", "", f"::: {name}", "    options:", "      members: false", "", *names(name)]
    for module in modules(name):
        lines += [f"## {module}", "", f"::: {module}", "    options:", "      heading_level: 3", ""]
    return "\n".join(lines)


def shadowed(name):
    """What a package exports under the name of one of its modules, which would be taken for the module."""
    files = {file.stem for file in init_of(name).parent.glob("*")}
    origins = {one: module for module, taken in imported(name).items() for one in taken}
    return [f"{origins[one]}.{one}" for one in exported(init_of(name)) if one in files and one in origins]


def names(name):
    """A table of the names that a root gathers from its modules, each a link."""
    gathered = imported(name)
    if not gathered:
        return []
    links = {module: ", ".join(link(module, one) for one in gathered[module]) for module in gathered}
    rows = [f"| `{module}` | {links[module]} |" for module in links]
    return [f"`import {name}` gives these names:", "", "| from | |", "|---|---|", *rows, ""]


def link(module, name):
    """A name with its page behind it."""
    hidden = {path.rsplit(".", 1)[1]: path for path in shadowed(module)} if init_of(module).exists() else {}
    return f"[{name}][{hidden.get(name, f'{module}.{name}')}]"


def imported(name):
    """By module: the names that a package takes out of it."""
    nodes = [node for node in ast.parse(read(init_of(name))).body if isinstance(node, ast.ImportFrom)]
    return {node.module: [alias.name for alias in node.names] for node in nodes}


def modules(name):
    """The modules of a package that say what they offer; of a root that gathers names, those of the names."""
    files = sorted(init_of(name).parent.glob("*.py"))
    offering = [f"{name}.{file.stem}" for file in files if not file.stem.startswith("_") and exported(file)]
    gathered = imported(name)
    return [module for module in offering if not gathered or module in gathered]


def init_of(name):
    """The file of a package."""
    return ROOT.joinpath(*name.split("."), "__init__.py")


def read(file):
    """A source file."""
    return file.read_text(encoding="utf-8")


def exported(file):
    """The names in a module's `__all__`."""
    for node in ast.parse(read(file)).body:
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
    return (ast.get_docstring(ast.parse(read(init_of(name)))) or "").split("\n", 1)[0]
