"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const $ = (id) => document.getElementById(id);
  const { summary, scenery, filters, generators, texts, metrics, objects, cycles } = data;
  const RISKS = ["safe", "low caution", "high caution", "danger", "fatal"];
  const CLASSES = ["unknown", "car", "truck", "bus", "trailer", "motorcycle", "bicycle", "pedestrian", "animal", "hazard", "over-drivable", "under-drivable"];
  const COLOURS = { 1: "#e0382b", 2: "#e9a100", 3: "#17a35a" };
  const STATES = ["rejected", "accepted", "shadow", "unjudged"], MARKS = ["✗", "✓", "✓", "–"], VERDICTS = ["rejected", "accepted", "accepted", "not judged in time"];

  /** Running sums of centimetre steps, as metres. */
  const decode = (steps) => {
    const line = new Float64Array(steps.length);
    let x = 0, y = 0;
    for (let i = 0; i < steps.length; i += 2) {
      line[i] = (x += steps[i]) / 100;
      line[i + 1] = (y += steps[i + 1]) / 100;
    }
    return line;
  };
  const paths = data.paths.map(decode);
  const still = {
    lines: scenery.lines.map(([kind, steps]) => [kind, decode(steps)]),
    lanes: scenery.lanes.map(decode),
    crosswalks: scenery.crosswalks.map(decode),
    stops: scenery.stop_lines.map(([id, steps, rules]) => ({ id, line: decode(steps), rules })),
    lights: scenery.lights.map(([rule, [x, y]]) => ({ rule, x: x / 100, y: y / 100 })),
    vehicle: scenery.vehicle.map((cm) => cm / 100),
  };
  // Lights are written when they change; each cycle gets the whole picture.
  let lit = {};
  for (const cycle of cycles) cycle.lit = cycle.s ? (lit = { ...lit, ...cycle.s }) : lit;

  const view = { x: 0, y: 0, scale: 8, angle: 0, moved: false };
  let at = 0, chosenCandidate = -1, hovered = -1, playing = 0;

  // ---- helpers ------------------------------------------------------------------------------------------------
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  let colour = {};
  const readColours = () => {
    for (const name of ["ground", "road", "border", "marking", "crosswalk", "accepted", "shadow", "rejected", "unjudged", "chosen", "ego", "object", "prediction", "violation", "anchor", "timer", "late", "ink", "soft", "paper", "line"]) colour[name] = css(name);
  };
  const node = (tag, text, className) => {
    const made = document.createElement(tag);
    if (text !== undefined) made.textContent = text;
    if (className) made.className = className;
    return made;
  };
  const row = (cells, tag = "td", className) => {
    const made = node("tr", undefined, className);
    for (const cell of cells) made.append(node(tag, cell));
    return made;
  };
  const short = (filter) => filter.name.replace(/_filter$/, "").replaceAll("_", " ") + (filter.enforced ? "" : " (shadow)");
  const number = (value) => value === "inf" ? "∞" : value === "-inf" ? "−∞" : value === null || value === undefined ? "–" : typeof value === "number" ? value.toLocaleString("en", { maximumFractionDigits: 3 }) : value;
  const milliseconds = (us) => us < 1000 ? `${Math.round(us)} µs` : `${(us / 1000).toFixed(us < 10000 ? 2 : 1)} ms`;
  const cycle = () => cycles[at];
  const isAccepted = (state) => state === 1 || state === 2;
  const survivors = (c) => c.c.filter((candidate) => isAccepted(candidate[2])).length;
  const isChosen = (index) => cycle().pick === index;

  // ---- drawing ------------------------------------------------------------------------------------------------
  const scene = $("scene"), timeline = $("timeline");
  const fitCanvas = (canvas) => {
    const ratio = window.devicePixelRatio || 1;
    const width = Math.max(1, canvas.clientWidth), height = Math.max(1, canvas.clientHeight);
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    return [pen, width, height];
  };
  let toScreen = (x, y) => [x, y];
  const setCamera = (width, height) => {
    const c = Math.cos(view.angle), s = Math.sin(view.angle);
    toScreen = (x, y) => {
      const dx = x - view.x, dy = y - view.y;
      return [width / 2 + view.scale * (c * dx + s * dy), height / 2 - view.scale * (-s * dx + c * dy)];
    };
  };
  const trace = (pen, line, closed) => {
    pen.beginPath();
    for (let i = 0; i < line.length; i += 2) {
      const [x, y] = toScreen(line[i], line[i + 1]);
      if (i) pen.lineTo(x, y); else pen.moveTo(x, y);
    }
    if (closed) pen.closePath();
  };
  const box = (x, y, yaw, front, rear, left, right) => {
    const c = Math.cos(yaw), s = Math.sin(yaw), corners = [];
    for (const [along, across] of [[front, left], [rear, left], [rear, right], [front, right]]) corners.push(x + c * along - s * across, y + s * along + c * across);
    return corners;
  };
  const objectShape = (outline, x, y, yaw) => {
    if (outline.length === 2) {
      const [length, width] = outline.map((cm) => cm / 200);
      return box(x, y, yaw, length, -length, width, -width);
    }
    if (outline.length === 1) {
      const corners = [];
      for (let i = 0; i < 16; i++) corners.push(x + outline[0] / 200 * Math.cos(i * Math.PI / 8), y + outline[0] / 200 * Math.sin(i * Math.PI / 8));
      return corners;
    }
    const local = decode(outline), corners = [], c = Math.cos(yaw), s = Math.sin(yaw);
    for (let i = 0; i < local.length; i += 2) corners.push(x + c * local[i] - s * local[i + 1], y + s * local[i] + c * local[i + 1]);
    return corners;
  };

  const drawStill = (pen) => {
    pen.fillStyle = colour.road;
    for (const lane of still.lanes) { trace(pen, lane, true); pen.fill(); }
    pen.fillStyle = colour.crosswalk;
    for (const crosswalk of still.crosswalks) { trace(pen, crosswalk, true); pen.fill(); }
    for (const [kind, line] of still.lines) {
      const marking = kind.startsWith("line_");
      pen.strokeStyle = marking ? colour.marking : colour.border;
      pen.lineWidth = marking ? 1 : 2;
      trace(pen, line, false);
      pen.stroke();
    }
    const shown = cycle().lit;
    for (const { line, rules } of still.stops) {
      const light = rules.map((rule) => COLOURS[shown[rule]]).find(Boolean);
      pen.strokeStyle = light || colour.soft;
      pen.lineWidth = light ? 4 : 2;
      trace(pen, line, false);
      pen.stroke();
    }
    for (const { rule, x, y } of still.lights) {
      const [sx, sy] = toScreen(x, y);
      pen.beginPath();
      pen.arc(sx, sy, 5, 0, 7);
      pen.fillStyle = COLOURS[shown[rule]] || colour.soft;
      pen.fill();
    }
  };
  const drawObjects = (pen, involved, after) => {
    const labels = [];
    for (const [id, kind, x, y, yaw, outline, predictions] of cycle().o) {
      const hot = id === involved;
      pen.setLineDash([3, 4]);
      pen.strokeStyle = hot ? colour.violation : colour.prediction;
      pen.lineWidth = hot ? 2 : 1;
      for (const [step, steps] of predictions) {
        const line = decode(steps);
        trace(pen, line, false);
        pen.stroke();
        if (!hot || after === null || line.length < 4) continue;
        // Where the road user is predicted to be when the violation happens.
        const place = Math.min(after / Math.max(step, 1), line.length / 2 - 1), i = Math.min(Math.floor(place), line.length / 2 - 2), part = place - i;
        const ax = line[2 * i], ay = line[2 * i + 1], dx = line[2 * i + 2] - ax, dy = line[2 * i + 3] - ay;
        trace(pen, objectShape(outline, ax + part * dx, ay + part * dy, dx || dy ? Math.atan2(dy, dx) : yaw / 1000), true);
        pen.stroke();
      }
      pen.setLineDash([]);
      const shape = objectShape(outline, x / 100, y / 100, yaw / 1000);
      trace(pen, shape, true);
      pen.fillStyle = hot ? colour.violation : colour.object;
      pen.fill();
      labels.push([CLASSES[kind] || "object", shape]);
    }
    if (view.scale > 3) for (const [text, shape] of labels) drawLabel(pen, text, shape);
  };
  /** Readable on whatever is there. */
  const drawText = (pen, text, x, y, ink) => {
    pen.lineWidth = 3;
    pen.strokeStyle = colour.ground;
    pen.strokeText(text, x, y);
    pen.fillStyle = ink;
    pen.fillText(text, x, y);
  };
  /** Above a shape. */
  const drawLabel = (pen, text, shape) => {
    let left = Infinity, right = -Infinity, top = Infinity;
    for (let i = 0; i < shape.length; i += 2) {
      const [sx, sy] = toScreen(shape[i], shape[i + 1]);
      left = Math.min(left, sx); right = Math.max(right, sx); top = Math.min(top, sy);
    }
    pen.font = "11px system-ui, sans-serif";
    pen.textAlign = "center";
    drawText(pen, text, (left + right) / 2, top - 4, colour.ink);
    pen.textAlign = "start";
  };
  const drawCandidate = (pen, index, strength) => {
    const [, , state, path] = cycle().c[index], name = STATES[state], picked = isChosen(index);
    pen.globalAlpha = strength;
    pen.strokeStyle = picked ? colour.chosen : colour[name];
    pen.lineWidth = picked ? 5 : index === chosenCandidate || index === hovered ? 4 : 1.8;
    pen.setLineDash(state === 0 ? [7, 5] : state === 3 ? [2, 5] : []);
    trace(pen, paths[path], false);
    pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  };
  /** The judgement to show of a candidate: the first enforced objection, else the first objection. */
  const objection = (candidate) => {
    let first = -1;
    for (let i = 0; i < candidate[4].length; i++) {
      if (candidate[4][i][0] === 1) continue;
      if (filters[i].enforced) return i;
      if (first < 0) first = i;
    }
    return first;
  };
  const draw = () => {
    if (!cycles.length) return;
    const [pen, width, height] = fitCanvas(scene);
    setCamera(width, height);
    pen.fillStyle = colour.ground;
    pen.fillRect(0, 0, width, height);
    drawStill(pen);
    const focus = hovered >= 0 ? hovered : chosenCandidate, c = cycle().c;
    const why = focus >= 0 && c[focus] ? objection(c[focus]) : -1;
    const evidence = why >= 0 ? c[focus][4][why][3] : null;
    drawObjects(pen, evidence ? evidence[5] : -2, evidence ? evidence[3] : null);
    const order = c.map((_, index) => index).sort((a, b) => isAccepted(c[a][2]) - isAccepted(c[b][2]));
    for (const index of order) if (index !== focus && !isChosen(index)) drawCandidate(pen, index, focus >= 0 ? 0.25 : isAccepted(c[index][2]) ? 0.9 : 0.6);
    for (const index of order) if (isChosen(index) && index !== focus) drawCandidate(pen, index, focus >= 0 ? 0.5 : 1);
    if (focus >= 0 && c[focus]) drawCandidate(pen, focus, 1);
    if (cycle().ego) {
      const [x, y, yaw] = cycle().ego;
      trace(pen, box(x / 100, y / 100, yaw / 1000, ...still.vehicle), true);
      pen.fillStyle = colour.ego;
      pen.fill();
    }
    if (evidence) {
      const [x, y, yaw, ms, element] = evidence;
      pen.strokeStyle = colour.violation;
      pen.lineWidth = 2;
      trace(pen, box(x / 100, y / 100, yaw / 1000, ...still.vehicle), true);
      pen.stroke();
      const hit = still.stops.find((stop) => stop.id === element);
      if (hit) { pen.lineWidth = 6; trace(pen, hit.line, false); pen.stroke(); }
      const [sx, sy] = toScreen(x / 100, y / 100);
      pen.lineWidth = 2.5;
      pen.beginPath();
      pen.arc(sx, sy, 7, 0, 7);
      pen.stroke();
      pen.font = "600 12px system-ui, sans-serif";
      drawText(pen, `after ${(ms / 1000).toFixed(1)} s`, sx + 11, sy + 18, colour.violation);
    }
    drawScale(pen, width, height);
  };
  const drawScale = (pen, width, height) => {
    const metres = [1, 2, 5, 10, 20, 50, 100, 200].find((m) => m * view.scale > 60) || 500, length = metres * view.scale;
    const x = width - 14 - length, y = height - 44;
    pen.strokeStyle = pen.fillStyle = colour.soft;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.moveTo(x, y - 4); pen.lineTo(x, y); pen.lineTo(x + length, y); pen.lineTo(x + length, y - 4);
    pen.stroke();
    pen.font = "11px system-ui, sans-serif";
    pen.fillText(`${metres} m`, x + 4, y - 6);
  };
  /** Everything that is judged, and the vehicle, upright with the heading to the right. */
  const fit = () => {
    const c = cycle();
    if (!c) return;
    const points = [];
    if (c.ego) points.push(c.ego[0] / 100, c.ego[1] / 100);
    for (const candidate of c.c) { const line = paths[candidate[3]]; for (let i = 0; i < line.length; i += 2) points.push(line[i], line[i + 1]); }
    if (!points.length) return;
    view.angle = c.ego ? c.ego[2] / 1000 : 0;
    const co = Math.cos(view.angle), s = Math.sin(view.angle);
    let [u0, u1, v0, v1] = [Infinity, -Infinity, Infinity, -Infinity];
    for (let i = 0; i < points.length; i += 2) {
      const u = co * points[i] + s * points[i + 1], v = -s * points[i] + co * points[i + 1];
      u0 = Math.min(u0, u); u1 = Math.max(u1, u); v0 = Math.min(v0, v); v1 = Math.max(v1, v);
    }
    u0 -= 8; u1 += 8; v0 -= 8; v1 += 8;
    // The legend lies over the lower edge.
    v0 -= 0.12 * (v1 - v0);
    const um = (u0 + u1) / 2, vm = (v0 + v1) / 2;
    view.x = co * um - s * vm;
    view.y = s * um + co * vm;
    view.scale = Math.max(0.5, Math.min(scene.clientWidth / (u1 - u0), scene.clientHeight / (v1 - v0), 25));
    view.moved = false;
  };

  // ---- panels -------------------------------------------------------------------------------------------------
  const showHeadline = () => {
    const c = cycle(), headline = $("headline");
    headline.replaceChildren();
    const kept = survivors(c), of = c.c.length;
    headline.append(c.why ? `nothing judged: ${c.why.replaceAll("_", " ")}` : kept ? `${kept} of ${of} candidates may be driven` : `none of ${of} candidates may be driven`);
    if (c.pick !== undefined) headline.append(node("small", `${generators[c.c[c.pick][0]]} #${c.c[c.pick][1]} is chosen`));
    const speed = c.ego ? `${(c.ego[3] / 100 * 3.6).toFixed(0)} km/h, ` : "";
    headline.append(node("small", `${speed}cycle ${c.n} started by ${c.a ? "an anchor" : "the timer"}, done after ${milliseconds(c.us)}`));
    headline.className = c.why || !kept ? "rejected-text" : "";
  };
  const showCandidates = () => {
    const list = $("candidates");
    list.replaceChildren();
    $("cycle-title").textContent = `Cycle ${cycle().n}: ${cycle().c.length} candidates`;
    cycle().c.forEach((candidate, index) => {
      const [generator, sample, state] = candidate, name = STATES[state];
      const option = node("div");
      option.id = `candidate-${index}`;
      option.setAttribute("role", "option");
      option.setAttribute("aria-selected", String(index === chosenCandidate));
      const why = objection(candidate);
      option.append(
        node("span", isChosen(index) ? "★" : MARKS[state], `${name}-text`),
        node("span", `${generators[generator]} #${sample}`),
        node("span", state === 3 ? VERDICTS[3] : why >= 0 ? short(filters[why]) : ""));
      option.addEventListener("click", () => select(index === chosenCandidate ? -1 : index));
      option.addEventListener("pointerenter", () => { hovered = index; draw(); });
      option.addEventListener("pointerleave", () => { hovered = -1; draw(); });
      list.append(option);
    });
  };
  const showDetail = () => {
    const detail = $("detail"), candidate = cycle().c[chosenCandidate];
    detail.replaceChildren();
    if (!candidate) {
      detail.append(node("p", cycle().c.length ? "Choose a candidate to see every judgement and its numbers." : "", "soft"));
      return;
    }
    const [generator, sample, state, , judgements] = candidate;
    detail.append(node("h2", `${generators[generator]} #${sample}: ${VERDICTS[state]}${isChosen(chosenCandidate) ? ", chosen" : ""}`));
    // Who objects comes first, and of those the filters whose objection counts.
    const weight = ([verdict], index) => verdict === 1 ? 2 : filters[index].enforced ? 0 : 1;
    const order = judgements.map((judgement, index) => [weight(judgement, index), index]).sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    for (const [, index] of order) {
      const [verdict, text, numbers] = judgements[index], { enforced } = filters[index], title = node("h3");
      const word = ["objects", "fine", "not assessed"][verdict];
      title.append(node("span", short(filters[index])), node("span", word, verdict === 1 ? "accepted-text" : enforced ? "rejected-text" : "shadow-text"));
      detail.append(title);
      if (text >= 0) detail.append(node("p", texts[text]));
      if (numbers.length) {
        const table = node("table");
        table.append(row(["metric", "value", "limit", "risk"], "th"));
        for (const [metric, value, limit, risk] of numbers) table.append(row([metrics[metric].replaceAll("_", "_\u200b"), number(value), number(limit), RISKS[risk]]));
        detail.append(table);
      }
    }
  };
  const select = (index) => {
    chosenCandidate = index;
    document.querySelectorAll("#candidates [role=option]").forEach((option, i) => option.setAttribute("aria-selected", String(i === index)));
    const option = $(`candidate-${index}`);
    if (option) option.scrollIntoView({ block: "nearest" });
    showDetail();
    draw();
  };
  const show = (index) => {
    if (!cycles.length) return;
    const before = cycle() && cycle().c[chosenCandidate];
    at = Math.max(0, Math.min(cycles.length - 1, index));
    // The same planner's same sample stays selected over time.
    chosenCandidate = before ? cycle().c.findIndex((c) => c[0] === before[0] && c[1] === before[1]) : -1;
    hovered = -1;
    $("slider").value = at;
    $("clock").textContent = `${(cycle().t / 1000).toFixed(2)} s · ${at + 1}/${cycles.length}`;
    if (!view.moved) fit();
    showHeadline();
    showCandidates();
    showDetail();
    draw();
    drawTimeline();
  };

  // ---- whole run ----------------------------------------------------------------------------------------------
  const slowest = cycles.reduce((slow, c) => Math.max(slow, c.us), 1);
  const drawTimeline = () => {
    const [pen, width, height] = fitCanvas(timeline);
    pen.clearRect(0, 0, width, height);
    const step = width / Math.max(1, cycles.length);
    cycles.forEach((c, index) => {
      pen.fillStyle = c.us > data.budget_us ? colour.late : c.a ? colour.anchor : colour.timer;
      const tall = Math.max(2, (height - 12) * Math.sqrt(c.us / slowest));
      pen.fillRect(index * step, height - 8 - tall, Math.max(1, step - 0.5), tall);
      if (c.why || !survivors(c)) { pen.fillStyle = colour.rejected; pen.fillRect(index * step, height - 6, Math.max(1, step - 0.5), 6); }
    });
    pen.fillStyle = colour.ink;
    pen.fillRect(at * step + step / 2 - 1, 0, 2, height);
  };
  const fact = (label, value, bad) => {
    const item = node("li", undefined, bad ? "bad" : "");
    item.append(node("b", value), ` ${label}`);
    $("facts").append(item);
  };
  const showRun = () => {
    const c = summary.cycles, k = summary.candidates;
    fact("cycles by anchors", c.anchor);
    fact("by the timer", c.timer);
    fact("candidates judged", k.judged);
    fact("accepted", k.accepted);
    fact("rejected", k.rejected);
    document.querySelector(".if-unjudged").hidden = !k.not_judged;
    if (k.not_judged) fact("not judged in time", k.not_judged, true);
    const late = cycles.filter((c) => c.us > data.budget_us).length;
    if (late) fact(`cycles over ${milliseconds(data.budget_us)}`, late, true);
    const latency = summary.latency_us.cycle;
    if (latency) fact("p99 per cycle", milliseconds(latency.p99));
    for (const error of summary.errors) fact(error.message, error.code, true);

    // Counted from the cycles on this page: the same as in the summary.
    const tally = new Map();
    let judged = 0, accepted = 0;
    for (const cycle of cycles) {
      for (const [generator, , state, , judgements] of cycle.c) {
        if (state === 3) continue;
        judged++;
        if (isAccepted(state)) accepted++;
        judgements.forEach(([verdict], filter) => {
          if (verdict === 1) return;
          const counts = tally.get(filter) || tally.set(filter, new Map()).get(filter);
          counts.set(generator, (counts.get(generator) || 0) + 1);
        });
      }
    }
    const table = $("rejections"), by = k.by_generator;
    table.dataset.judged = judged;
    table.dataset.accepted = accepted;
    const columns = [...tally.keys()].sort((a, b) => a - b);
    const sum = (counts) => [...counts.values()].reduce((a, b) => a + b, 0);
    table.append(row(["generator", "judged", "accepted", ...columns.map((filter) => short(filters[filter]))], "th"));
    generators.forEach((name, g) => {
      const counts = by[name] || { judged: 0, accepted: 0 };
      table.append(row([name, counts.judged, counts.accepted, ...columns.map((filter) => tally.get(filter).get(g) || "")]));
    });
    table.append(row(["all", k.judged, k.accepted, ...columns.map((filter) => sum(tally.get(filter)))], "td", "total"));
    columns.forEach((filter) => { table.dataset[`filter${filter}`] = sum(tally.get(filter)); });

    $("latency").append(row(["stage", "p50", "p90", "p99", "max"], "th"));
    for (const [stage, q] of Object.entries(summary.latency_us)) $("latency").append(row([stage.replace(/^filter\./, "· ").replace(/_filter$/, ""), milliseconds(q.p50), milliseconds(q.p90), milliseconds(q.p99), milliseconds(q.max)]));
    showHistogram();
    const input = $("input"), facts = { input: summary.input.name ?? summary.input, seed: summary.input.seed, interface: summary.interface, threads: summary.threads, settings: summary.settings_hash, version: summary.version, "wall time": `${number(summary.wall_s)} s`, "peak memory": `${number(summary.peak_memory_mb)} MB` };
    for (const [label, value] of Object.entries(facts)) if (value !== null && value !== undefined) input.append(row([label, String(value)]));
    for (const [topic, m] of Object.entries(summary.messages)) input.append(row([topic, `${m.received}`]));
  };
  const showHistogram = () => {
    if (!cycles.length) return;
    const BINS = 40, low = Math.log10(Math.max(1, cycles.reduce((fast, c) => Math.min(fast, c.us), Infinity))), high = Math.log10(slowest) + 1e-9, bins = new Array(BINS).fill(0);
    for (const c of cycles) bins[Math.min(BINS - 1, Math.floor(BINS * (Math.log10(Math.max(1, c.us)) - low) / Math.max(1e-9, high - low)))]++;
    const most = Math.max(...bins), ns = "http://www.w3.org/2000/svg", svg = document.createElementNS(ns, "svg");
    svg.setAttribute("viewBox", "0 0 400 100");
    svg.setAttribute("preserveAspectRatio", "none");
    bins.forEach((count, i) => {
      const bar = document.createElementNS(ns, "rect");
      for (const [key, value] of Object.entries({ x: i * 10 + 0.5, width: 9, y: 100 - 95 * count / most, height: 95 * count / most })) bar.setAttribute(key, value);
      svg.append(bar);
    });
    const scale = node("p", undefined, "scale");
    for (const share of [0, 0.25, 0.5, 0.75, 1]) scale.append(node("span", milliseconds(10 ** (low + share * (high - low)))));
    $("histogram").append(svg, scale);
  };

  // ---- input --------------------------------------------------------------------------------------------------
  const nearestCandidate = (px, py) => {
    let best = -1, least = 12;
    cycle().c.forEach((candidate, index) => {
      const line = paths[candidate[3]];
      for (let i = 0; i + 3 < line.length; i += 2) {
        const [ax, ay] = toScreen(line[i], line[i + 1]), [bx, by] = toScreen(line[i + 2], line[i + 3]);
        const dx = bx - ax, dy = by - ay, t = Math.max(0, Math.min(1, ((px - ax) * dx + (py - ay) * dy) / (dx * dx + dy * dy || 1)));
        const distance = Math.hypot(px - ax - t * dx, py - ay - t * dy);
        if (distance < least) { least = distance; best = index; }
      }
    });
    return best;
  };
  let grip = null;
  const place = (event) => { const r = scene.getBoundingClientRect(); return [event.clientX - r.left, event.clientY - r.top]; };
  scene.addEventListener("pointerdown", (event) => { grip = { start: place(event), x: view.x, y: view.y, dragged: false }; scene.setPointerCapture(event.pointerId); });
  scene.addEventListener("pointermove", (event) => {
    const [px, py] = place(event);
    if (!grip) {
      const near = nearestCandidate(px, py);
      if (near !== hovered) { hovered = near; draw(); }
      return;
    }
    const dx = px - grip.start[0], dy = py - grip.start[1];
    if (Math.hypot(dx, dy) > 4) grip.dragged = true;
    const c = Math.cos(view.angle), s = Math.sin(view.angle), u = -dx / view.scale, v = dy / view.scale;
    view.x = grip.x + c * u - s * v;
    view.y = grip.y + s * u + c * v;
    view.moved = view.moved || grip.dragged;
    draw();
  });
  scene.addEventListener("pointerup", (event) => {
    if (grip && !grip.dragged) select(nearestCandidate(...place(event)));
    grip = null;
  });
  scene.addEventListener("pointerleave", () => { hovered = -1; draw(); });
  const zoom = (factor) => { view.scale = Math.max(0.3, Math.min(80, view.scale * factor)); view.moved = true; draw(); };
  scene.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(-event.deltaY / 400)); }, { passive: false });
  timeline.addEventListener("click", (event) => { const r = timeline.getBoundingClientRect(); show(Math.floor((event.clientX - r.left) / r.width * cycles.length)); });
  $("slider").max = Math.max(0, cycles.length - 1);
  $("slider").addEventListener("input", (event) => show(Number(event.target.value)));
  const play = () => {
    clearTimeout(playing);
    playing = playing ? 0 : 1;
    $("play").textContent = playing ? "❚❚" : "▶";
    const next = () => {
      if (!playing) return;
      if (at + 1 >= cycles.length) return play();
      const wait = Math.min(500, Math.max(10, cycles[at + 1].t - cycle().t));
      show(at + 1);
      playing = setTimeout(next, wait);
    };
    next();
  };
  $("play").addEventListener("click", play);
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const count = cycle() ? cycle().c.length : 0;
    const actions = {
      ArrowLeft: () => show(at - 1), ArrowRight: () => show(at + 1),
      ArrowUp: () => count && select(Math.max(0, chosenCandidate - 1)), ArrowDown: () => count && select(Math.min(count - 1, chosenCandidate + 1)),
      Home: () => show(0), End: () => show(cycles.length - 1), Escape: () => select(-1), " ": play,
      f: () => { fit(); draw(); }, "+": () => zoom(1.25), "-": () => zoom(0.8),
      n: () => { const next = cycles.findIndex((c, i) => i > at && (c.why || !survivors(c))); if (next >= 0) show(next); },
    };
    const action = actions[event.key] || actions[event.key.toLowerCase()];
    if (action && !(event.target.id === "play" && event.key === " ")) { event.preventDefault(); action(); }
  });
  window.addEventListener("resize", () => { if (!view.moved) fit(); draw(); drawTimeline(); });
  window.addEventListener("beforeprint", () => { readColours(); draw(); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readColours(); draw(); drawTimeline(); });

  readColours();
  showRun();
  if (cycles.length) {
    // The first cycle in which something was judged says more than the first cycle.
    show(Math.max(0, cycles.findIndex((c) => c.c.length)));
    if (data.focus !== null) select(data.focus);
  } else {
    $("headline").textContent = "no cycle ran";
  }
})();
