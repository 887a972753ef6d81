"""What tests ask of a page in a browser."""

import numpy as np
import pytest


def settle(page):
    """Wait until what was asked for is drawn."""
    page.evaluate(
        "() => new Promise(done => requestAnimationFrame(() => "
        "requestAnimationFrame(done)))"
    )


def until(page, expression, patience=200):
    """Wait for something; the page's policy allows no evaluation of text of its own."""
    for _ in range(patience):
        if page.evaluate(expression):
            return
        page.wait_for_timeout(50)
    pytest.fail(f"never: {expression}")


def frames_in_half_a_second(page, seconds):
    """Most frames of a playing scene in half a second, as others may keep the cores."""
    times = page.evaluate(
        """seconds => new Promise(done => {
          const [times, scene] = [[], window.rearview.scene];
          let before = scene.frames;
          const end = performance.now() + 1000 * seconds;
          const look = now => {
            if (scene.frames > before) times.push(performance.now());
            before = scene.frames;
            if (performance.now() < end) requestAnimationFrame(look);
            else done(times);
          };
          requestAnimationFrame(look);
        })""",
        seconds,
    )
    counts = [
        int(np.searchsorted(times, begin + 500.0)) - k for k, begin in enumerate(times)
    ]
    return max(counts)


def watch_shifts(page):
    """Collect what moves on the page from now on in `window.shifts`."""
    page.evaluate(
        "() => { window.shifts = []; new PerformanceObserver((list) => {"
        " for (const one of list.getEntries()) window.shifts.push(one.value); })"
        ".observe({ type: 'layout-shift', buffered: false }); }"
    )


def violations(page, impacts=None):
    """What axe finds, only of some impacts if they are given."""
    from axe_playwright_python.sync_playwright import Axe

    found = Axe().run(page).response["violations"]
    return [
        (v["id"], v["impact"])
        for v in found
        if impacts is None or v["impact"] in impacts
    ]


def fits(page, size):
    """Whether nothing is wider than the window."""
    return page.evaluate("document.documentElement.scrollWidth") <= size["width"]
