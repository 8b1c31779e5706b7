"""A text that would be markup anywhere, and what a page makes of it."""

import html.parser

# an element nobody else has, a link, code and a heading of Markdown, a formula that matplotlib cannot read
HOSTILE = "<xss-mark id=xss>x</xss-mark> [xss](http:xss.example) `xss` **xss** $\\xss{$ & # _x_"


class Elements(html.parser.HTMLParser):
    """Elements and texts of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.names: list[str] = []
        self.text = ""
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """An element begins."""
        self.names.append(tag)

    def handle_data(self, data: str) -> None:
        """A text."""
        self.text += data


def shown_as_text(page: str) -> bool:
    """True if a page shows the text as it is, and has no element of it."""
    found = Elements(page)
    return HOSTILE in found.text and not {"xss-mark", "strong", "em", "code"} & set(found.names)
