// The page of a run: its scene, its charts, and what was decided in the step shown.

const BOXES = {
  plan: "p", candidates: "c", believed: "b", ghost: "g", names: "n", measure: "m", turn: "u",
};

function start(data) {
  const run = readRun(data);
  const scene = new Scene(byId("scene"), run);
  const facts = new Facts(run, scene);
  const graph = run.graphs && new SpeedGraph(byId("graph"), run.graphs);
  const phases = phasesOf(run);
  byId("fastest").textContent = scene.fastest.toFixed(0);
  const replay = startReplay({
    time: run.time,
    events: run.events,
    scene,
    boxes: BOXES,
    shown: { follow: true },
    file: document.title.split(":")[0].replace(/[^\w]+/g, "_"),
    egoAt: (t) => scene.egoAt(t),
    extent: () => [Array.from(run.ego.x), Array.from(run.ego.y)],
    makeChart: (figure, number, onScrub) => {
      const chart = new Chart(figure, run.curves[number], run.time, onScrub);
      chart.mark(run.events, phases);
      return chart;
    },
    onStep: (step, charts) => {
      facts.show(step, charts);
      if (graph) graph.draw(step, scene.colours);
    },
    onResize: () => facts.reserve(),
  });
  window.rearview = { run, ...replay }; // for the console
}

if (byId("copy")) {
  byId("copy").addEventListener("click", () => {
    copyText(byId("copy"), byId("command").textContent);
  });
}
const run = JSON.parse(byId("data").textContent);
if (run !== null) start(run);
