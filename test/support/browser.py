"""Headless Chromium on pages of this machine; its pictures are drawn in software, without a graphics card."""

import contextlib
import importlib.util
import shutil
from collections.abc import Iterator
from typing import Any

CHROMIUM = "chromium"
SIZE = (1280, 800)
PATIENCE = 180.0  # s that a page may take on a busy machine
# WebGL in software; nothing that looks for other machines
FLAGS = (
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


def missing() -> str:
    """What is missing for a browser, with the remedy; empty if it is all there."""
    if shutil.which(CHROMIUM) is None:
        return "no chromium: sudo apt-get install chromium"
    if importlib.util.find_spec("playwright") is None:
        return "no playwright: ./run python -m pip install --no-deps -r requirements/browser.txt"
    return ""


@contextlib.contextmanager
def page(url: str, size: tuple[int, int] = SIZE, scale: float = 1.0) -> Iterator[Any]:
    """A page of a viewer, drawn with `scale` points each way to a pixel, without the notice that software draws it."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which(CHROMIUM), args=list(FLAGS))
        try:
            opened = browser.new_page(viewport={"width": size[0], "height": size[1]}, device_scale_factor=scale)
            opened.set_default_timeout(1e3 * PATIENCE)
            opened.goto(url)
            opened.wait_for_selector("canvas")
            opened.get_by_role("img", name="artificial horizon").wait_for()
            notice = opened.locator(".mantine-Notification-closeButton")
            notice.first.wait_for()
            notice.first.click()
            yield opened
        finally:
            browser.close()
