"""A page for a browser, and a results folder that commands read."""

import tempfile
from pathlib import Path

import biped

folder = Path(tempfile.mkdtemp())
result = biped.run("demo/robot", duration=3.0, push=[], expect={}, **{"window.end": 3.0})
print(result.report(folder / "page.html"))
print(result.save(folder / "result"))
