"""A clip from the front, four times slower than life."""

import tempfile
from pathlib import Path

import biped

result = biped.run("demo/robot", duration=2.0, push=[], expect={}, **{"window.end": 2.0})
clip = Path(tempfile.mkdtemp()) / "robot.gif"
print(result.video(clip, width=320, start=1.0, end=1.3, slow=4.0, eye="front"))
