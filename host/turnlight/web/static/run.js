// What the page knows of the run, kept up to date by events.

export const run = {
  state: "idle", session: null, sample: "", count: 0, shots: new Set(), skipped: {}, changes: [],
  enough: false, cause: null, secondsLeft: null, current: null, step: null, mapsVersion: 0, linked: false,
  calibration: null, refining: null,
};

const watchers = new Set();

/** Calls back after every event until the returned function is called. */
export function watch(callback) {
  watchers.add(callback);
  return () => watchers.delete(callback);
}

export const active = () => run.state !== "idle";

export function setLinked(linked) {
  run.linked = linked;
  tell({ kind: "link" });
}

export function apply(event) {
  switch (event.kind) {
    case "snapshot":
      Object.assign(run, {
        state: event.state, session: nameOf(event.folder), sample: event.sample ?? "", count: event.count,
        shots: new Set(event.shots), skipped: event.skipped, changes: event.changes, enough: event.enough,
        cause: event.cause, mapsVersion: run.mapsVersion + 1,
      });
      break;
    case "state":
      run.state = event.state;
      run.cause = null;
      break;
    case "started":
      Object.assign(run, {
        session: nameOf(event.folder), sample: event.sample, count: event.count,
        shots: new Set(event.safe), skipped: {}, changes: [], enough: false, cause: null,
        secondsLeft: null, current: null,
      });
      break;
    case "step":
      if (event.step === "planned" || run.current === null) run.current = event.number;
      run.step = event.step;
      break;
    case "shot":
      run.shots.add(event.number);
      run.secondsLeft = event.seconds_left;
      if (event.change !== null) run.changes = [...run.changes, event.change];
      run.mapsVersion++;
      break;
    case "rebuilt":
      run.shots = new Set(event.shots);
      run.changes = event.changes;
      run.mapsVersion++;
      break;
    case "skipped": run.skipped = { ...run.skipped, [event.number]: event.cause }; break;
    case "enough": run.enough = true; break;
    case "interrupted":
    case "faulted":
    case "refused": run.cause = event.cause; break;
    case "calibration": run.calibration = event; break;
    case "refining": run.refining = event; break;
    case "finished": run.mapsVersion++; run.secondsLeft = 0; break;
  }
  tell(event);
}

function tell(event) {
  for (const watcher of [...watchers]) watcher(event);
}

function nameOf(folder) {
  return folder ? folder.split(/[\\/]/).at(-1) : null;
}
