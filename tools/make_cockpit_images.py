"""Makes the pictures of the cockpit in docs/images: `./run python tools/make_cockpit_images.py`.

A flight at 5 m/s, linearized, recorded, and disturbed by a doublet; taken at two sizes. The browser is that of the
tests, see test/support/browser.py.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "test" / "support"))

import browser  # noqa: E402

COCKPIT = ROOT / "install" / "sbs_sim" / "lib" / "sbs_sim" / "cockpit"
IMAGES = ROOT / "docs" / "images"
PORT = 8197
SIZES = {"cockpit": (1280, 800), "cockpit_1920": (1920, 1080)}
PACE = "0.5"  # time to draw without a graphics card
BEFORE, AFTER = 4000, 9000  # ms until the doublet, and from then to the picture


def main() -> None:
    """Fly and take the pictures."""
    if reason := browser.missing():
        sys.exit(reason)
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES
    with tempfile.TemporaryDirectory() as bags:
        own = {"ROS_DOMAIN_ID": "97", "SBS_SIM_BAGS": bags}
        command = [sys.executable, str(COCKPIT), "--port", str(PORT)]
        process = subprocess.Popen(command, env={**os.environ, **own}, stdout=subprocess.PIPE, text=True)
        try:
            assert process.stdout is not None
            address = process.stdout.readline().split()[-1]
            for name, size in SIZES.items():
                with browser.page(address, size) as page:
                    _take(page, folder / f"{name}.png", modes=name != "cockpit")
        finally:
            process.terminate()
            process.wait(30)


def _take(page: object, path: Path, modes: bool) -> None:
    """Fly for some seconds, and take the picture, with the modes if wanted."""
    page.get_by_text("Reset to a trimmed flight").click()
    page.get_by_label("Airspeed [m/s]").fill("5")
    page.get_by_label("Airspeed [m/s]").press("Enter")
    page.get_by_text("Reset to a trimmed flight").click()
    page.get_by_label("Real time ×").click()
    page.get_by_role("option", name=PACE, exact=True).click()
    page.get_by_role("button", name="Reset", exact=True).click()
    page.wait_for_timeout(1000)
    page.get_by_role("button", name="Linearize here").click()
    page.get_by_text("Linear model at").first.wait_for()
    page.keyboard.press("Space")
    page.wait_for_timeout(BEFORE)
    page.get_by_role("button", name="Doublet").click()
    page.mouse.move(640, 100)
    if modes:
        page.get_by_role("tab", name="Modes").click()
    page.wait_for_timeout(AFTER)
    page.screenshot(path=path)
    page.keyboard.press("Space")


if __name__ == "__main__":
    main()
