"""What the page has beyond what viser serves: a title, keys that act whatever was clicked last, a layout for phones.

Viser has no place for any of it: it is written into the head of the one file that the page is.
"""

import gzip
import re
from functools import lru_cache

from websockets.http11 import Response

TITLE = "sbs_sim cockpit"
ICON = (
    "data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 32 32' fill='none' stroke='%230072b2'"
    " stroke-width='3'%3E%3Ccircle cx='8' cy='16' r='6.5'/%3E%3Ccircle cx='24' cy='16' r='6.5'/%3E%3Cpath"
    " d='M16 7v18'/%3E%3C/svg%3E"
)
# What was clicked keeps the focus: space would press a button again, and a closed list or a box would take the keys.
# They go to the page instead, unless one came there by the tabulator key. Return ends the typing of a number.
SCRIPT = """
const kept = "button, [role=tab], [role=button], input[type=checkbox], input[aria-haspopup]:not([aria-expanded=true])";
let clicked = false;
addEventListener("pointerdown", () => { clicked = true; }, true);
addEventListener("keydown", (event) => {
  const focus = document.activeElement;
  if (event.key === "Tab") clicked = false;
  else if (event.key === "Enter" && focus?.matches("input[inputmode]")) focus.blur();
  else if (event.isTrusted && event.key.length === 1 && clicked && focus?.matches(kept)) {
    focus.blur();
    event.preventDefault();
    event.stopImmediatePropagation();
    document.body.dispatchEvent(new KeyboardEvent("keydown", event));
  }
}, true);
"""
# The bar of a slider reaches from its least value: where zero is in the middle, it says nothing. On a phone viser's
# sheet covers the picture: here it lies below it, as wide as the screen.
STYLE = """
.mantine-Slider-bar { background-color: transparent !important; }
.mantine-Slider-mark {
  border-color: var(--mantine-color-gray-4) !important; background: var(--mantine-color-gray-4) !important;
  width: 1px !important; border-radius: 0 !important;
}
@media (max-width: 36em) {
  div[style*="flex-grow: 1; height: 100%"] { height: 38% !important; }
  div[style*="max-height: 60%"] { width: 100vw !important; height: 62% !important; max-height: 62% !important; }
  div[style*="max-height: 60%"] div[style*="width: 20em"] { width: 100vw !important; }
}
"""


def with_page_head(response: Response) -> Response:
    """A response of viser's server, with ours in it if it is the page."""
    if response.status_code != 200 or not response.headers.get("Content-Type", "").startswith("text/html"):
        return response
    zipped = response.headers.get("Content-Encoding") == "gzip"
    response.body = _page(bytes(response.body), zipped)
    del response.headers["Content-Length"]
    response.headers["Content-Length"] = str(len(response.body))
    return response


@lru_cache(maxsize=2)
def _page(body: bytes, zipped: bool) -> bytes:
    page = (gzip.decompress(body) if zipped else body).decode()
    page = re.sub(r'<link\s+rel="icon".*?/>', f'<link rel="icon" href="{ICON}" />', page, count=1, flags=re.DOTALL)
    ours = f"<title>{TITLE}</title><style>{STYLE}</style><script>{SCRIPT}</script>"
    page = re.sub("<title>.*?</title>", lambda _: ours, page, count=1)
    return gzip.compress(page.encode()) if zipped else page.encode()
