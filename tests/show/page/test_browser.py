"""The page in a real browser: it draws, the scrubber moves the figure, the console is silent, both themes, a phone."""

from __future__ import annotations

from itertools import pairwise

import pytest

from biped.cli.main import main
from tests.show.page.browser import MISSING, browser

pytestmark = pytest.mark.skipif(bool(MISSING), reason=MISSING)

SWEEP = """
[sweep]
"ground.slope" = [0.0, 2.0]
"""
ALSO = (
    ["run", "level_normal", "--set", "duration=1.5", "--set", "window.start=0.7", "--set", "window.end=1.5", "--set",
     "push=[{at=0.4,duration=0.2,force=[-80.0,0.0]}]", "--out", "one"],
    ["report", "one", "c", "--html", "page.html"],
)  # fmt: skip
FEET = "return [...document.querySelectorAll('[data-part=first]')].map(leg => leg.getAttribute('points'))"
MOVED = """const scrub = document.querySelectorAll('[data-part=scrub]')[arguments[0]];
scrub.value = arguments[1]; scrub.dispatchEvent(new Event('input')); return scrub.value"""


ACCESS = r"""
const lum = c => { const v = c.match(/[\d.]+/g).slice(0, 3).map(x => x / 255)
  .map(x => x <= 0.03928 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
  return 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]; };
const ratio = (a, b) => { const [x, y] = [lum(a), lum(b)].sort((p, q) => q - p); return (x + 0.05) / (y + 0.05); };
const clear = c => c === 'transparent' || /, 0\)$/.test(c);
const under = e => {
  for (; e; e = e.parentElement) { const c = getComputedStyle(e).backgroundColor; if (!clear(c)) return c; }
  return 'rgb(255, 255, 255)'; };
const all = s => [...document.querySelectorAll(s)];
const worded = e => [...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim());
const drawn = e => e.getClientRects().length && !['SCRIPT', 'STYLE', 'OPTION', 'title'].includes(e.tagName);
const needs = s => {  // WCAG AA: 3 for large words, 4.5 for others
  const size = parseFloat(s.fontSize);
  return size >= 24 || (size >= 18.66 && Number(s.fontWeight) >= 700) ? 3 : 4.5; };
const shows = e => {
  const s = getComputedStyle(e);
  return ratio(e instanceof SVGElement ? s.fill : s.color, under(e)) / needs(s); };
const named = e => e.getAttribute('aria-label') || e.textContent.trim() || e.labels?.length || e.getAttribute('alt');
const scrolls = e => ['auto', 'scroll'].includes(getComputedStyle(e).overflowX) && e.scrollWidth > e.clientWidth + 1;
const short = e => e.outerHTML.slice(0, 80);
return {
  faint: all('body *').filter(e => worded(e) && drawn(e) && shows(e) < 1).map(short),
  nameless: all('button, input, select, a, img, svg[role=img], [role=tab]').filter(e => !named(e)).map(short),
  unreachable: all('body *').filter(e => scrolls(e) && e.tabIndex < 0).map(short),
  twice: all('[id]').map(e => e.id).filter((id, i, ids) => ids.indexOf(id) !== i),
  levels: all('h1, h2, h3, h4, h5, h6').map(e => Number(e.tagName[1])),
  language: document.documentElement.lang, title: document.title, main: all('main').length};"""


@pytest.fixture(scope="module")
def page(folder):
    assert (folder / "page.html").stat().st_size < 3_000_000
    return folder / "page.html"


@pytest.fixture(scope="module")
def differing(folder):
    """The page of a difference between a walk and the same on slippery ground."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        short = ["--set", "duration=1.0", "--set", "window.start=0.5", "--set", "window.end=1.0", "--jobs", "1"]
        many = ["--set", "randomise.runs=2", "--set", "start.jitter=0.002"]
        for name, friction in (("here", 1.0), ("there", 0.5)):
            main(["run", "level_normal", *short, *many, "--set", f"ground.friction={friction}", "--out", name])
        main(["diff", "here", "there", "--html", "differing.html"])
    return folder / "differing.html"


@pytest.fixture(scope="module")
def compared(folder):
    """The page of a scenario in two engines."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        short = ["--set", "duration=2.0", "--set", "window.start=1.0", "--set", "window.end=2.0"]
        assert main(["compare", "level_normal", *short, "--out", "k"]) == 0
        assert main(["report", "k", "--html", "compared.html"]) == 0
    return folder / "compared.html"


@pytest.fixture(scope="module")
def shown():
    with browser() as opened:
        yield opened


def test_it_draws_without_network_and_without_a_complaint(shown, page):
    shown.open(page)
    assert shown.complaints() == []
    drawn = shown.run(
        "return [...document.querySelectorAll('svg')].filter(s => s.getBoundingClientRect().width > 0)"
        ".map(s => [s.getBoundingClientRect().width, s.getBoundingClientRect().height])"
    )
    assert len(drawn) > 15
    assert all(width > 100 and height > 10 for width, height in drawn)
    assert shown.run("return performance.getEntriesByType('resource').length") == 0


def test_the_scrubber_moves_the_figure(shown, page):
    shown.open(page)
    before = shown.run(FEET)
    assert shown.run(MOVED, 0, 40) == "40"
    after = shown.run(FEET)
    assert before[0] != after[0]
    assert before[1:] == after[1:]  # the other walks stand still
    time = shown.run("return document.querySelector('[data-part=time]').textContent")
    assert time == "1.00 s"
    cursor = shown.run("return Number(document.querySelector('.cursor').getAttribute('x1'))")
    assert cursor == pytest.approx(1000 * 40 / 59, abs=1)
    # The push of 0.4 to 0.6 s has its arrow then, and not later.
    arrow = "return document.querySelector('[data-part=push]').getAttribute('d')"
    assert shown.run(arrow) == ""
    shown.run(MOVED, 0, 20)
    assert shown.run(arrow).startswith("M")
    assert shown.run("return document.querySelector('[data-part=said]').textContent") == "80 N backward"


def test_it_plays_to_the_end(shown, page):
    shown.open(page)
    shown.run(MOVED, 0, 50)
    until = "return document.querySelector('[data-part=play]').getAttribute('aria-label')"
    assert shown.run("document.querySelector('[data-part=play]').click(); " + until) == "Pause"
    done = """const scrub = document.querySelector('[data-part=scrub]');
    return new Promise(resolve => { const look = () => scrub.value === scrub.max ? resolve(true) : setTimeout(look, 30);
    look(); })"""
    assert shown.run(done)
    assert shown.run(until) == "Play"


def test_another_engines_walker_is_a_ghost_that_goes_its_own_way(shown, compared):
    shown.open(compared)
    leg = "return document.querySelector('[data-part={}]').getAttribute('points')"
    legs = [leg.format("first"), leg.format("ghost0first")]
    begun = [shown.run(one) for one in legs]
    assert begun[0] == begun[1]  # the same start
    shown.run(MOVED, 0, 70)
    later = [shown.run(one) for one in legs]
    assert later[0] != later[1]
    assert later[1] != begun[1]
    assert shown.run("return [...document.querySelectorAll('[role=tab]')].map(tab => tab.textContent)") == [
        "together", "MuJoCo", "home"]  # fmt: skip
    assert shown.run("return document.querySelector('.legend').textContent").endswith("ghost: home")
    assert shown.complaints() == []


def test_a_tab_shows_its_run_alone(shown, page):
    shown.open(page)
    seen = "return [...document.querySelectorAll('.walks')[1].querySelectorAll('.walk')].map(w => w.hidden)"
    first = shown.run(seen)
    assert first[0] is False
    if len(first) > 1:
        assert all(first[1:])
        shown.run("document.querySelectorAll('.walks')[1].querySelectorAll('[role=tab]')[1].click()")
        assert shown.run(seen)[:2] == [True, False]


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [360, 1200])
def test_nothing_sticks_out_of_a_phone_and_words_are_readable_in_both_themes(shown, page, width, dark):
    shown.open(page, width, dark)
    assert shown.run("return document.documentElement.scrollWidth") <= width
    contrast = shown.run("""
      const lum = c => { const v = c.match(/[\\d.]+/g).slice(0, 3).map(x => x / 255)
        .map(x => x <= 0.03928 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
        return 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]; };
      const ratio = (a, b) => {
        const [x, y] = [lum(a), lum(b)].sort((p, q) => q - p);
        return (x + 0.05) / (y + 0.05);
      };
      const paper = getComputedStyle(document.querySelector('.card')).backgroundColor;
      const words = ['h2', '.about', 'figcaption', 'th', '.good, .bad'].map(s => document.querySelector(s))
        .filter(e => e).map(e => ratio(getComputedStyle(e).color, paper));
      const ticks = ratio(getComputedStyle(document.querySelector('.tick')).fill, paper);
      const leg = s => getComputedStyle(document.querySelector(`.limb.${s}`)).stroke;
      const legs = ['right', 'left'].map(s => ratio(leg(s), paper));
      return [Math.min(...words, ticks), Math.min(...legs)]""")
    assert contrast[0] >= 4.5  # WCAG AA of text
    assert contrast[1] >= 3.0  # and of graphics


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [400, 1400])
def test_pages_can_be_read_heard_and_used_by_keyboard(shown, page, differing, width, dark):
    """The checks of Lighthouse that need no network: contrast of every word, names, headings, keyboard."""
    for one in (page, differing):
        shown.open(one, width, dark)
        found = shown.run(ACCESS)
        assert found["faint"] == []
        assert found["nameless"] == []
        assert found["unreachable"] == []
        assert found["twice"] == []
        assert (found["language"], found["main"], bool(found["title"])) == ("en", 1, True)
        levels = found["levels"]
        assert levels[0] == 1
        assert all(below <= above + 1 for above, below in pairwise(levels)), levels
        assert shown.run("return document.documentElement.scrollWidth") <= width


def test_the_leg_that_is_read_about_has_one_colour_everywhere(shown, page):
    shown.open(page)
    for side in ("right", "left"):
        colours = shown.run(
            """const of = (s, p) => [...document.querySelectorAll(s)].map(e => getComputedStyle(e)[p]);
            const side = arguments[0];
            return [...new Set([...of(`.limb.${side}`, 'stroke'), ...of(`.line.${side}`, 'stroke'),
              ...of(`rect.s1.${side}`, 'fill'), ...of(`.key.${side}`, 'backgroundColor')])]""",
            side,
        )
        assert len(colours) == 1


def test_paper_shows_the_stroboscope_and_no_buttons(shown, page):
    shown.open(page)
    shown.devtools("Emulation.setEmulatedMedia", media="print")
    seen = "return getComputedStyle(document.querySelector(arguments[0])).display"
    assert shown.run(seen, ".strobe") == "block"
    assert shown.run(seen, ".controls") == "none"
    shown.devtools("Emulation.setEmulatedMedia", media="")
    assert shown.run(seen, ".strobe") == "none"
