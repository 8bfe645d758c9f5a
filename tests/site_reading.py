"""What a built site holds, and the commands that documentation shows."""

import re
import shlex
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import click

ROOT = Path(__file__).resolve().parents[1]
NOTES = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").rglob("*.md")),
    *sorted((ROOT / "firmware").rglob("*.md")),
    *sorted((ROOT / "examples").rglob("*.md")),
]
LOADING = {"script": "src", "img": "src", "iframe": "src", "source": "src", "video": "src", "embed": "src"}
FENCED = re.compile(r"^```(?P<language>\w*)[^\n]*\n(?P<text>.*?)^```", re.DOTALL | re.MULTILINE)
INDENTED = re.compile(r"(?<=\n\n)(?:(?: {4}.*)?\n)+")
LINK = re.compile(r"(?:\]\(|src=\")([^)\s\"]+)")
SPAN = re.compile(r"(?<!`)`(factorlab [^`\n]+)`(?!`)")


@dataclass
class Page(HTMLParser):
    """What one page loads, where its links go, where links may land, and what it says plainly."""

    path: Path
    loads: list = field(default_factory=list)
    links: list = field(default_factory=list)
    anchors: set = field(default_factory=set)
    paragraphs: list = field(default_factory=list)

    def __post_init__(self):
        super().__init__()
        self._inside = False
        self.feed(self.path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        said = dict(attrs)
        self.anchors |= {said.get("id"), said.get("name")} - {None}
        if tag == "link" and said.get("rel") not in {"canonical", "prev", "next"}:
            self.loads.append(said["href"])
        if said.get(LOADING.get(tag)):
            self.loads.append(said[LOADING[tag]])
        if tag == "a" and "href" in said:
            self.links.append(said["href"])
        if tag == "p":
            self._inside = True
            self.paragraphs.append("")

    def handle_endtag(self, tag):
        self._inside = self._inside and tag != "p"

    def handle_data(self, data):
        if self._inside:
            self.paragraphs[-1] += data


def is_elsewhere(address):
    """Whether an address needs a network."""
    return urlsplit(address).scheme in {"http", "https"} or address.startswith("//")


def landing(page, link):
    """The file that a link of a page means, and the anchor in it."""
    parts = urlsplit(link)
    target = (page.path.parent / unquote(parts.path)).resolve() if parts.path else page.path.resolve()
    return target, unquote(parts.fragment)


def linked_files(note):
    """The files that a Markdown page links to or shows."""
    text = re.sub(r"`[^`\n]*`", "", FENCED.sub("\n", note.read_text(encoding="utf-8")))
    targets = [one.split("#")[0] for one in LINK.findall(re.sub(r"\n\n(?: {4}.*\n+)+", "\n\n", text))]
    return [(note.parent / one).resolve() for one in targets if one and not is_elsewhere(one)]


def blocks(text):
    """Code blocks of a Markdown page: the language where it says one, and the text."""
    rest = FENCED.sub("\n", text)
    fenced = [(found["language"], found["text"]) for found in FENCED.finditer(text)]
    return fenced + [
        ("", re.sub(r"^ {4}", "", found[0], flags=re.MULTILINE)) for found in INDENTED.finditer(rest)
    ]


def python_blocks(text):
    """The blocks that are Python, by their language or their first word."""
    return [
        code
        for language, code in blocks(text)
        if language == "python" or (not language and re.match(r"\s*(import|from) \w", code))
    ]


def command_lines(text):
    """Every `factorlab …` of a page, in blocks and in sentences, without comments."""
    lines = [found[1] for found in SPAN.finditer(text)]
    for language, code in blocks(text):
        if language in {"", "console", "bash", "sh", "text"}:
            joined = re.sub(r"\\\n\s*", " ", code).replace("; ", "\n")
            lines += [line for line in joined.splitlines() if re.match(r"(\w+=\S* )*factorlab ", line)]
    return [re.sub(r"\s{2,}.*|\s#.*", "", re.sub(r"^.*?\bfactorlab", "factorlab", line)) for line in lines]


def faults_of(line, command):
    """What a command line gets wrong: words that are no command, options that do not exist."""
    words = shlex.split(re.sub(r"[\[\]]", " ", line).replace("'", " "))[1:]
    reached = [command]
    while words and all(isinstance(one, click.Group) for one in reached):
        if words[0].startswith("-"):
            break
        names = words.pop(0)
        if names.isupper() or names == "…":  # a word for any command
            return []
        inner = [one.get_command(click.Context(one), name) for one in reached for name in names.split("|")]
        if None in inner:
            return [f"{names} is no command"]
        reached = inner
    known = {"--help", "-h"}  # of several commands (`build|emulate`), one has to know an option
    for parameter in (parameter for one in reached for parameter in one.params):
        known |= {*parameter.opts, *parameter.secondary_opts}
    given = [part.split("=")[0] for word in words for part in word.split("|")]
    names = "|".join(one.name for one in reached)
    return [f"{names} has no {one}" for one in given if re.match(r"--?[a-zA-Z]", one) and one not in known]
