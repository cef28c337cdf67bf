"""A real browser without a window, for the pages that people open from their disk."""

import contextlib
import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
# WebGL without a graphics card.
SOFTWARE_GRAPHICS = ("--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader")


@dataclass
class Visit:
    """A page as it is open, with what it has complained of and asked for."""

    page: Page
    errors: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)


def find_browser() -> str:
    """The browser's program, or a failure that says what to install."""
    found = [path for name in BROWSERS if (path := shutil.which(name))]
    if not found:
        raise FileNotFoundError(
            f"The pages are tested in Chromium, and none of {', '.join(BROWSERS)} is here: "
            f"apt-get install chromium"
        )
    return found[0]


@contextlib.contextmanager
def visit(target: Path | str) -> Iterator[Visit]:
    """Opens a file in a browser that has no network, or an address of this machine."""
    local = isinstance(target, Path)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=find_browser(),
            args=SOFTWARE_GRAPHICS,
            chromium_sandbox=os.getuid() != 0,  # Chromium's sandbox refuses root
        )
        context = browser.new_context(viewport={"width": 800, "height": 600}, offline=local)
        page = context.new_page()
        visited = Visit(page)
        page.on("console", lambda message: _note(visited, message.type, message.text))
        page.on("pageerror", lambda error: visited.errors.append(str(error)))
        page.on("request", lambda request: visited.requests.append(request.url))
        page.goto(target.resolve().as_uri() if local else target, wait_until="load")
        yield visited
        browser.close()


def _note(visited: Visit, kind: str, text: str) -> None:
    if kind == "error":
        visited.errors.append(text)
