"""A headless Chromium, spoken to over WebDriver by the standard library alone."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
import tempfile
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

MISSING = (
    ""
    if shutil.which("chromedriver") and (shutil.which("chromium") or shutil.which("google-chrome"))
    else "no Chromium with its driver here (Debian: apt-get install chromium chromium-driver)"
)
"""Why there is no browser; empty if there is one."""


class Browser:
    """A session of chromedriver.

    Args:
        url: Where the driver listens.
    """

    def __init__(self, url: str):
        self._url = url
        arguments = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"]
        options = {"args": arguments, **({"binary": found} if (found := shutil.which("chromium")) else {})}
        wanted = {"browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
        self._session = self._ask("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})["sessionId"]

    def _ask(self, method: str, path: str, body: Any = None) -> Any:
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self._url + path, data, {"Content-Type": "application/json"}, method=method)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return json.load(answer)["value"]

    def open(self, page: Path, width: int = 1200, dark: bool = False) -> None:
        """Opens a file at a width [px], in a theme, without any network."""
        self.devtools("Network.enable")
        offline = {"offline": True, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0}
        self.devtools("Network.emulateNetworkConditions", **offline)
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600}
        self.devtools("Emulation.setDeviceMetricsOverride", **size)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.devtools("Emulation.setEmulatedMedia", features=[scheme])
        self._ask("POST", f"/session/{self._session}/url", {"url": page.resolve().as_uri()})

    def devtools(self, command: str, **params: Any) -> Any:
        """One command of the DevTools protocol."""
        return self._ask("POST", f"/session/{self._session}/goog/cdp/execute", {"cmd": command, "params": params})

    def run(self, script: str, *args: Any) -> Any:
        """What a script returns."""
        return self._ask("POST", f"/session/{self._session}/execute/sync", {"script": script, "args": list(args)})

    def complaints(self) -> list[str]:
        """What the console said since it was asked last."""
        return [
            entry["message"] for entry in self._ask("POST", f"/session/{self._session}/se/log", {"type": "browser"})
        ]

    def picture(self, path: Path) -> None:
        """The whole page as PNG."""
        told = self.devtools("Page.captureScreenshot", captureBeyondViewport=True, format="png")
        path.write_bytes(base64.b64decode(told["data"]))

    def paper(self, path: Path) -> None:
        """The page as it is printed, as PDF."""
        told = self.devtools("Page.printToPDF", printBackground=True)
        path.write_bytes(base64.b64decode(told["data"]))

    def close(self) -> None:
        """Ends the session."""
        self._ask("DELETE", f"/session/{self._session}")


@contextmanager
def browser() -> Iterator[Browser]:
    """A browser until the block ends."""
    with tempfile.TemporaryFile("w+") as log:
        driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=log, text=True)
        try:
            assert driver.stdout is not None
            found = next(m for line in driver.stdout if (m := re.search(r"successfully on port (\d+)", line)))
            opened = Browser(f"http://127.0.0.1:{found[1]}")
            try:
                yield opened
            finally:
                opened.close()
        finally:
            driver.terminate()
            driver.communicate()
