// The page of several runs: one clock, a colour and a dash for each.

const BOXES = { plan: "p", names: "n", measure: "m", turn: "u", apart: "b" };

function start(data) {
  const runs = data.runs.map((one) => ({ ...readRun(one), label: one.label }));
  const longest = runs.reduce((one, run) =>
    (run.time[run.time.length - 1] > one.time[one.time.length - 1] ? run : one));
  const { time } = longest;
  const scene = new OverlaidScene(byId("scene"), runs);
  const shown = { follow: true, traffic: runs.map(() => true), followed: 0 };
  const phases = phasesOf(longest);
  const stepOf = (t) => stepAt(time, t + 1e-4);
  const events = data.events.map((event) => ({
    ...event,
    step: stepOf(event.time),
    until: event.until === null ? null : stepOf(event.until),
  }));
  byId("fastest").textContent = scene.fastest.toFixed(0);
  const replay = startReplay({
    time,
    events,
    scene,
    boxes: BOXES,
    shown,
    file: "comparison",
    egoAt: (t) => scene.egoAt(t, shown.followed),
    extent: () => ["x", "y"].map((name) => runs.flatMap((run) => Array.from(run.ego[name]))),
    makeChart: (figure, number, onScrub) => {
      const chart = new OverlaidChart(figure, overlaidCurve(runs, number), time, onScrub);
      chart.mark(events.filter(({ gravity }) => gravity !== "note"), phases);
      chart.readout.style.minWidth = "0"; // it has a line of its own
      return chart;
    },
    onStep: () => {},
    onResize: () => {},
  });
  wireRuns(shown, replay.player.onChange);
  window.rearview = { runs, ...replay }; // for the console
}

// Whose traffic is shown, and which ego the view follows.
function wireRuns(shown, touch) {
  for (const box of document.querySelectorAll("input[data-traffic]")) {
    const number = Number(box.dataset.traffic);
    shown.traffic[number] = box.checked;
    box.addEventListener("change", () => {
      shown.traffic[number] = box.checked;
      touch();
    });
  }
  byId("followed").addEventListener("change", () => {
    shown.followed = Number(byId("followed").value);
    touch();
  });
}

start(JSON.parse(byId("data").textContent));
