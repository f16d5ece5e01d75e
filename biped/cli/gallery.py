"""docs/gallery.md: a clip of every kind of walk that ships, and what it is worth by its recorded numbers.

`python -m biped.cli.gallery` writes the page; with `--clips` it runs every scenario once and draws its clip, too.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from biped.base.errors import markdown_table
from biped.show.document import DOCS, share
from biped.show.references import means_of
from biped.studies.regress.references import RecordedScenario, References, read, shipped

PAGE, CLIPS = DOCS / "gallery.md", DOCS / "gallery"


class GalleryEntry(NamedTuple):
    """An entry of the gallery.

    Attributes:
        scenario: Its name.
        title: What people call it.
        words: What is to be seen, in a sentence.
        start: [s] where the clip begins.
        end: [s] where it ends.
        goal: What a run has to do.
    """

    scenario: str
    title: str
    words: str
    start: float = 2.0
    end: float = 5.0
    goal: str = "walked"

    @property
    def clip(self) -> str:
        """File name of its clip."""
        return self.scenario.replace("/", "_") + ".gif"


ENTRIES = (
    GalleryEntry(
        "upright/push", "The flagship, pushed", "The gait `whole` of a planar human is pushed with 200 N.", 4.4, 7.4
    ),
    GalleryEntry("upright/slope", "The flagship on slopes", "The same gait, 3 and 5 degrees up and down."),
    GalleryEntry(
        "upright/home", "The flagship at home", "The same gait in the thesis's own simulator of rigid contacts."
    ),
    GalleryEntry("robust/steep", "Steep ground", "The gait `robust` on the steepest slopes that it was searched for."),
    GalleryEntry("level_normal", "The thesis's gait", "The published gains at normal speed, as printed."),
    GalleryEntry("calm/sit", "Sitting down", "The planar human sits down on a seat.", 2.0, 5.0, "sat"),
    GalleryEntry("robot/level", "The thesis's robot", "The robot of chapter IV, within its motors' limits."),
    GalleryEntry("spatial/level", "A human in space", "The same law in three dimensions."),
    GalleryEntry(
        "spatial/push_sideways", "Pushed sideways", "The human in space is pushed with 50 N to the left.", 3.4, 6.4
    ),
    GalleryEntry("spatial/turn", "Turning", "The human in space changes its heading."),
    GalleryEntry(
        "any/h1_walk", "Unitree's H1", "The law on a public robot: generalized forces, a gait in its own units."
    ),
    GalleryEntry("any/h1", "H1 stands", "A law that balances any robot, here pushed on a slope.", 0.5, 2.9, "stood"),
    GalleryEntry(
        "any/humanoid", "A humanoid on spheres", "The same law with a sphere for each foot.", 0.5, 2.9, "stood"
    ),
)

_HEAD = """# Gallery

You want to see what biped can simulate. Each row has one robot and one kind of law, and the scenario that runs it.
`biped run SCENARIO` repeats a row with all its runs.

*Walked*, *stood* and *sat* count the recorded runs of the scenario, which are at most twelve
([recorded numbers](references.md)). The brackets have the 95 % interval of the rate: it is wide, because so few runs
prove little. Each clip shows the first run. `make gallery` draws the clips again.

"""


def page(references: References) -> str:
    """The text of docs/gallery.md."""
    rows = []
    for entry in ENTRIES:
        one = references.scenarios[entry.scenario]
        speed, cost, *_ = means_of(one)
        picture = f"![{entry.title}](gallery/{entry.clip})"
        words = f"**{entry.title}**. {entry.words} `{entry.scenario}`"
        rows.append((picture, words, _outcome(one, entry.goal), speed, cost))
    return _HEAD + markdown_table(("", "walk", "outcome", "speed [m/s]", "cost of transport"), rows) + "\n"


def _outcome(one: RecordedScenario, goal: str) -> str:
    count, runs = one.ends.count("w" if goal == "walked" else "s"), len(one.runs)
    return f"{goal} {share(count, runs)}"


def draw(out: Path) -> None:
    """Runs each scenario's first run and writes its clip into a folder."""
    from biped.cli.main import main
    from biped.show.film import Cut, film

    out.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix="biped-") as folder:
        for entry in ENTRIES:
            run = Path(folder) / entry.clip
            main(["run", entry.scenario, "--only", "0", "--out", str(run)])
            film([run], out / entry.clip, Cut(280, 200, 12.0, entry.start, entry.end))


if __name__ == "__main__":
    if "--clips" in sys.argv[1:]:
        draw(CLIPS)
    PAGE.write_text(page(read(shipped())), encoding="utf-8")
