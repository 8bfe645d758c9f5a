"""What is written outside `docs/` gets its page too: the course, its results, the examples, the firmware.

A link that leaves `docs/` for a file lands on a page of that file: the site is whole without a network.
"""

import ast
import html
import posixpath
import re
from pathlib import Path

from mkdocs.structure.files import File, InclusionLevel

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"(?P<before>\]\()(?P<target>[^)\s#:]+)(?P<after>[^)\s]*(?:\s+\"[^\"]*\")?\))")
EXAMPLE = re.compile(r"<code>(?P<path>(?:examples/[\w/]+|\d\d_\w+)\.py)</code>(?!</a>)")
# files of the project that have a place of their own
PLACES = {
    "RESULTATS.md": "l19/resultats.md",
    "CHANGELOG.md": "changelog.md",
    "README.md": "index.md",
    "firmware/README.md": "firmware_source.md",
    ".github/CONTRIBUTING.md": "contributing.md",
}


def written():
    """The pages of the project outside `docs/`, and its examples."""
    notes = [*PLACES, *relative(ROOT.glob("examples/l19/**/*.md"))]
    scripts = relative(ROOT.glob("examples/**/*.py"))
    return [path for path in (*notes, *scripts) if path != "README.md" and (ROOT / path).is_file()]


def relative(paths):
    """Paths from the top of the project, in order."""
    return sorted(path.relative_to(ROOT).as_posix() for path in paths)


def place(path):
    """Where a file of the project lies in the site."""
    if path.startswith("docs/"):
        return path.removeprefix("docs/")
    if path in PLACES:
        return PLACES[path]
    if path.startswith("examples/l19/") and path.endswith(".md"):
        return path.removeprefix("examples/").replace("README.md", "index.md")
    return f"{path}.md" if (ROOT / path).suffix not in {".md", ".png", ".svg"} else path


def origin(uri):
    """The file of the project that a page of the site was written in."""
    return ORIGINS.get(uri, f"docs/{uri}")


ORIGINS = {place(path): path for path in written()}


def on_config(config):
    """The course, in French, and the examples: what there is of them."""
    course = ["l19/index.md"]
    course += [path.removeprefix("docs/") for path in relative(ROOT.glob("docs/l19*.md"))]
    course += [path.removeprefix("docs/") for path in relative(ROOT.glob("docs/l19/*.md"))]
    course += [path.removeprefix("docs/") for path in relative(ROOT.glob("docs/derivations*.md"))]
    course += sorted((uri for uri in ORIGINS if uri.startswith("l19/") and uri not in course), key=last)
    config.nav.append({"Cours L19": course})
    config.nav.append({"Project": ["contributing.md", "changelog.md", "firmware_source.md"]})
    return config


def last(uri):
    """The results behind everything else."""
    return uri == place("RESULTATS.md"), uri


def on_files(files, config):
    """Add the pages, and a page for every other file that one of them links to."""
    named = set(written())
    for file in list(files.documentation_pages()):
        if not file.generated_by:
            named |= set(outside(f"docs/{file.src_uri}", file.content_string))
    for path in followed(named):
        ORIGINS[place(path)] = path
        files.append(made(config, path))
    return files


def followed(named):
    """These files, and those that they link to in turn."""
    found, waiting = set(), set(named)
    while waiting:
        found |= waiting
        notes = [path for path in waiting if path.endswith(".md")]
        waiting = {
            there for path in notes for there in outside(path, (ROOT / path).read_text("utf-8"))
        } - found
    return sorted(found)


def outside(source, text):
    """The files outside `docs/` that a text links to."""
    targets = [target for found in LINK.finditer(text) if (target := resolved(source, found["target"]))]
    return [target for target in targets if not target.startswith("docs/") and target != "README.md"]


def resolved(source, target):
    """The file of the project that a link means, or None where there is none."""
    here = "" if target.startswith("/") else posixpath.dirname(source)
    path = posixpath.normpath(posixpath.join(here, target.lstrip("/")))
    return path if not path.startswith("..") and (ROOT / path).is_file() else None


def made(config, path):
    """One page, or one picture."""
    uri, source = place(path), ROOT / path
    if not uri.endswith(".md"):
        return File.generated(config, uri, abs_src_path=str(source))
    text = source.read_text(encoding="utf-8")
    content = text if path.endswith(".md") else listing(path, text)
    in_nav = path in PLACES or (path.startswith("examples/l19/") and path.endswith(".md"))
    inclusion = InclusionLevel.INCLUDED if in_nav else InclusionLevel.NOT_IN_NAV
    return File.generated(config, uri, content=content, inclusion=inclusion)


def listing(path, text):
    """A source file as a page: its docstring to read, then the code."""
    language = {".py": "python", ".c": "c", ".h": "c", ".toml": "toml"}.get(Path(path).suffix, "text")
    said, code = told(text) if language == "python" else ("", text)
    figure = f"docs/resultats/{Path(path).stem}.png"
    shown = f"![{Path(path).stem}](/{figure})" if (ROOT / figure).is_file() else ""
    listed = f"````{language}\n{code.strip()}\n````\n"
    return "\n\n".join([f"# {path}", html.escape(said, quote=False), shown, listed])


def told(text):
    """The docstring of a script as Markdown, where a list begins after an empty line, and its code."""
    tree = ast.parse(text)
    said = ast.get_docstring(tree)
    if said is None:
        return "", text
    said = re.sub(r"^(?! *(?:-|\d+\.) )(.*\S)\n(?= *(?:-|\d+\.) )", r"\1\n\n", said, flags=re.MULTILINE)
    return said, "\n".join(text.split("\n")[tree.body[0].end_lineno :])


def on_page_markdown(markdown, page, config, files):
    """Turn links to files into links to their pages."""
    source = origin(page.file.src_uri)

    def turned(found):
        path = resolved(source, found["target"])
        if path is None or files.get_file_from_path(place(path)) is None:
            return found[0]
        here = posixpath.dirname(page.file.src_uri) or "."
        return f"{found['before']}{posixpath.relpath(place(path), here)}{found['after']}"

    return LINK.sub(turned, markdown)


def on_page_content(content, page, config, files):
    """Make the name of an example a link to it."""

    def linked(found):
        path = found["path"] if "/" in found["path"] else f"examples/l19/{found['path']}"
        target = files.get_file_from_path(place(path))
        return found[0] if target is None else f'<a href="{target.url_relative_to(page.file)}">{found[0]}</a>'

    return EXAMPLE.sub(linked, content)


def on_post_page(output, page, config):
    """Say which pages are French."""
    uri = page.file.src_uri
    french = uri.startswith(("l19", "examples/l19/")) or uri.endswith(".fr.md")
    return output.replace('<html lang="en"', '<html lang="fr"', 1) if french else output
