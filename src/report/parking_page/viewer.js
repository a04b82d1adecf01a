"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const plan = data.plan, points = plan.trajectory;
const byId = (id) => document.getElementById(id);
const number = (value, digits) => typeof value === "number" ? value.toFixed(digits) : value === "inf" ? "∞" : "–";

function make(name, attributes, parent) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent.append(element);
  return element;
}

// y grows upwards in the scene and downwards on the page.
const corners = (places) => places.map(([x, y]) => `${x.toFixed(3)},${(-y).toFixed(3)}`).join(" ");

function outline([x, y, yaw]) {
  const [front, rear, left, right] = data.vehicle, cos = Math.cos(yaw), sin = Math.sin(yaw);
  return [[front, left], [front, right], [rear, right], [rear, left]]
    .map(([along, across]) => [x + cos * along - sin * across, y + sin * along + cos * across]);
}

function facts() {
  const words = { planned: "Planned", best_effort: "Planned as far as it went", failed: "No plan" };
  byId("verdict").textContent = words[plan.status] + (plan.reason ? `: ${plan.reason}` : "");
  byId("verdict").className = plan.status === "planned" ? "" : "bad";
  const rows = [["took", `${number(plan.times_ms.total, 0)} ms`]];
  if (points.length) {
    rows.unshift(["length", `${number(plan.length_m, 2)} m`], ["gear changes", plan.gear_changes],
      ["duration", `${number(plan.duration_s, 1)} s`], ["clearance", `${number(plan.min_clearance_m, 3)} m`]);
  }
  for (const [name, value] of rows) {
    const row = document.createElement("li"), strong = document.createElement("b");
    strong.textContent = value;
    row.append(`${name} `, strong);
    byId("facts").append(row);
  }
}

function scene() {
  const svg = byId("scene");
  const places = [...data.obstacles.flat(), ...outline(data.start), ...outline(data.goal)];
  for (const point of points) places.push(...outline([point.x, point.y, point.yaw]));
  const xs = places.map(([x]) => x), ys = places.map(([, y]) => -y);
  // Far walls must not shrink the manoeuvre: they are shown as far as the bounds reach.
  const reach = 4, [xMin, xMax, yMin, yMax] = data.bounds;
  const left = Math.max(Math.min(...xs), xMin - reach) - 1, right = Math.min(Math.max(...xs), xMax + reach) + 1;
  const top = Math.max(Math.min(...ys), -yMax - reach) - 1, bottom = Math.min(Math.max(...ys), -yMin + reach) + 1;
  svg.setAttribute("viewBox", `${left} ${top} ${right - left} ${bottom - top}`);
  make("rect", { class: "bounds", x: xMin, y: -yMax, width: xMax - xMin, height: yMax - yMin }, svg);
  for (const line of data.obstacles) {
    const last = line[line.length - 1], closed = line.length > 2 && line[0][0] === last[0] && line[0][1] === last[1];
    make(closed ? "polygon" : "polyline", { class: closed ? "solid" : "wall", points: corners(line) }, svg);
  }
  let drawn = -1;
  points.forEach((point, index) => {
    const before = points[Math.max(drawn, 0)];
    if (drawn < 0 || Math.hypot(point.x - before.x, point.y - before.y) > 0.4 || Math.abs(point.yaw - before.yaw) > 0.1) {
      make("polygon", { class: `swept ${point.gear}`, points: corners(outline([point.x, point.y, point.yaw])) }, svg);
      drawn = index;
    }
  });
  for (let begin = 0; begin + 1 < points.length;) {
    let end = begin + 1;
    while (end + 1 < points.length && points[end].gear === points[begin].gear) end += 1;
    const way = points.slice(begin, end + 1).map((point) => [point.x, point.y]);
    make("path", { class: `way ${points[begin].gear}`, d: `M${corners(way).replaceAll(" ", " L")}` }, svg);
    begin = end;
  }
  make("polygon", { class: "start", points: corners(outline(data.start)) }, svg);
  make("polygon", { class: "goal", points: corners(outline(data.goal)) }, svg);
  const vehicle = make("g", { class: "vehicle" }, svg);
  make("polygon", { points: "" }, vehicle);
  make("path", { d: "" }, vehicle);
  return vehicle;
}

function chart(title, unit, value) {
  const row = document.createElement("div"), name = document.createElement("span");
  const values = points.map(value), low = Math.min(0, ...values), high = Math.max(0, ...values);
  const span = high - low || 1, end = points[points.length - 1].t;
  name.textContent = `${title}, ${unit} (${low.toFixed(2)} to ${high.toFixed(2)})`;
  row.className = "chart";
  row.append(name);
  const svg = make("svg", { viewBox: "0 0 1000 100", preserveAspectRatio: "none" }, row);
  const y = (number) => 95 - 90 * (number - low) / span, x = (time) => 1000 * time / end;
  make("line", { class: "zero", x1: 0, x2: 1000, y1: y(0), y2: y(0) }, svg);
  make("polyline", { class: "value", points: points.map((point, i) => `${x(point.t).toFixed(1)},${y(values[i]).toFixed(1)}`).join(" ") }, svg);
  const now = make("line", { class: "now", y1: 0, y2: 100 }, svg);
  byId("charts").append(row);
  return (time) => { now.setAttribute("x1", x(time)); now.setAttribute("x2", x(time)); };
}

facts();
const vehicle = scene();
const slider = byId("slider");
if (points.length > 1) {
  const follow = [chart("speed", "m/s", (point) => point.v), chart("curvature", "1/m", (point) => point.kappa),
    chart("acceleration", "m/s²", (point) => point.a)];
  const end = points[points.length - 1].t;
  slider.max = end;
  const at = (time) => {
    let index = points.findIndex((point) => point.t >= time);
    if (index < 0) index = points.length - 1;
    const to = points[index], from = points[Math.max(index - 1, 0)];
    const part = to.t > from.t ? (time - from.t) / (to.t - from.t) : 1;
    const mix = (key) => from[key] + part * (to[key] - from[key]);
    const turn = Math.atan2(Math.sin(to.yaw - from.yaw), Math.cos(to.yaw - from.yaw));
    return { x: mix("x"), y: mix("y"), yaw: from.yaw + part * turn, v: mix("v"), steer: mix("steer"), gear: from.gear };
  };
  const show = () => {
    const time = Number(slider.value), state = at(time);
    vehicle.children[0].setAttribute("points", corners(outline([state.x, state.y, state.yaw])));
    const axle = [state.x + data.wheel_base * Math.cos(state.yaw), state.y + data.wheel_base * Math.sin(state.yaw)];
    const yaw = state.yaw + state.steer, wheel = [0.4 * Math.cos(yaw), 0.4 * Math.sin(yaw)];
    const ends = [[axle[0] - wheel[0], axle[1] - wheel[1]], [axle[0] + wheel[0], axle[1] + wheel[1]]];
    vehicle.children[1].setAttribute("d", `M${corners([[state.x, state.y], axle]).replace(" ", " L")} M${corners(ends).replace(" ", " L")}`);
    byId("clock").textContent = `${time.toFixed(1)} of ${end.toFixed(1)} s, ${state.v.toFixed(2)} m/s, ${state.gear}`;
    follow.forEach((chart) => chart(time));
  };
  slider.addEventListener("input", show);
  let playing = null;
  const toggle = () => {
    if (playing !== null) { cancelAnimationFrame(playing); playing = null; byId("play").textContent = "▶"; return; }
    if (Number(slider.value) >= end) slider.value = 0;
    const begun = performance.now() - 1000 * Number(slider.value);
    const step = (now) => {
      slider.value = Math.min((now - begun) / 1000, end);
      show();
      if (Number(slider.value) < end) { playing = requestAnimationFrame(step); } else { playing = null; byId("play").textContent = "▶"; }
    };
    byId("play").textContent = "❚❚";
    playing = requestAnimationFrame(step);
  };
  byId("play").addEventListener("click", toggle);
  document.addEventListener("keydown", (event) => {
    if (event.key === " " && event.target.tagName !== "BUTTON") { event.preventDefault(); toggle(); }
  });
  show();
} else {
  document.querySelector("nav").hidden = true;
}
