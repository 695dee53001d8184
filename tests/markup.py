"""A parser of pages for tests."""

from html.parser import HTMLParser

VOID = {"meta", "link", "img", "input", "br", "hr"}
FETCHED = {"src", "href", "action", "srcset", "data", "poster"}


class Markup(HTMLParser):
    """The texts, frames, addresses and link targets of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.whole = True
        """Whether all elements are closed in the correct order."""
        self.texts: dict[str, str] = {}
        """Texts by element, or by the type of a script."""
        self.addresses: list[str] = []
        """All addresses from which a browser might load something."""
        self.places: set[str] = set()
        """Names to which links may lead."""
        self.frames: list[str] = []
        self.feed(page)
        self.whole &= not self.open

    @property
    def text(self) -> str:
        """The whole text, including scripts."""
        return "".join(self.texts.values())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value for name, value in attrs if value}
        if tag not in VOID:
            self.open.append(given.get("type", tag) if tag == "script" else tag)
        self.addresses += [value for name, value in given.items() if name in FETCHED]
        self.places |= {value for name, value in given.items() if name in ("id", "name")}
        self.frames += [value for name, value in given.items() if name == "srcdoc"]

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            last = self.open.pop() if self.open else ""
            self.whole &= tag in (last, "script")

    def handle_data(self, data: str) -> None:
        name = self.open[-1] if self.open else ""
        self.texts[name] = self.texts.get(name, "") + data
