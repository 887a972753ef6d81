// Columns of numbers as packed.py writes them, and the run made of them.

const NOTHING = 65535; // code of a value that is not there

function unpack(packed) {
  const raw = atob(packed.data);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i += 1) bytes[i] = raw.charCodeAt(i);
  if (packed.whole) return new Uint32Array(bytes.buffer);
  if (packed.step === undefined) return new Float32Array(bytes.buffer);
  const codes = new Uint16Array(bytes.buffer);
  const values = new Float64Array(codes.length);
  for (let i = 0; i < codes.length; i += 1) {
    values[i] = codes[i] === NOTHING ? NaN : packed.low + packed.step * codes[i];
  }
  return values;
}

function unpackAll(columns) {
  const found = {};
  for (const [name, column] of Object.entries(columns)) {
    const packed = column !== null && typeof column === "object" && "data" in column;
    found[name] = packed ? unpack(column) : column;
  }
  return found;
}

function unpackTexts(column) {
  const codes = unpack(column.codes);
  return Object.assign((step) => column.texts[codes[step]], { texts: column.texts });
}

// For each row of the vehicles, the row of the same vehicle one step on, or -1.
function rowsAfter(vehicles) {
  const after = new Int32Array(vehicles.id.length).fill(-1);
  const before = new Int32Array(vehicles.ids.length).fill(-1);
  for (let step = 0; step + 1 < vehicles.start.length; step += 1) {
    const first = vehicles.start[step];
    for (let row = first; row < vehicles.start[step + 1]; row += 1) {
      const id = vehicles.id[row];
      const last = before[id];
      if (last >= 0 && step > 0 && last >= vehicles.start[step - 1] && last < first) {
        after[last] = row;
      }
      before[id] = row;
    }
  }
  return after;
}

function readRun(data) {
  const vehicles = unpackAll(data.vehicles);
  const cycles = {};
  for (const [name, column] of Object.entries(data.cycles)) {
    cycles[name] = "texts" in column ? unpackTexts(column) : unpack(column);
  }
  return {
    step: data.step,
    time: unpack(data.time),
    ego: unpackAll(data.ego),
    contacts: unpackTexts(data.ego.contacts),
    ghost: unpackAll(data.ghost),
    vehicles: { ...vehicles, after: rowsAfter(vehicles) },
    believed: data.believed && unpackAll(data.believed),
    plans: unpackAll(data.plans),
    cycles,
    road: data.road,
    obstacles: data.obstacles,
    signals: data.signals,
    events: data.events,
    candidates: data.candidates && unpackAll(data.candidates),
    graphs: data.graphs && unpackAll(data.graphs),
    curves: data.curves.map((curve) => ({
      ...curve,
      series: curve.series.map((one) => ({ ...one, values: unpack(one.values) })),
    })),
  };
}

// The last step that is not after a time.
function stepAt(time, t) {
  let low = 0;
  let high = time.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (time[middle] <= t + 1e-6) low = middle;
    else high = middle - 1;
  }
  return low;
}
