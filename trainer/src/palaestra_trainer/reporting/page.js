"use strict";
/* Moves the robots of the replays, from above and in 3D; the page is complete without it. */
const FIRST = {azimuth: -1.95, elevation: 0.8, away: 0.88};
const prepared = new Map();  /* the parts of a scene, by the element with its section's scenes, and its number */

/* Return a function that shows a replay in 3D at a share of its time; null if the replay has no 3D. */
function inSpace(figure, film) {
  const canvas = figure.querySelector("canvas"), above = figure.querySelector("svg");
  const button = figure.querySelector(".view");
  if (!canvas) return null;
  if (!space) { figure.querySelector(".flat").hidden = false; return null; }
  const source = figure.closest("section").querySelector(".scenes"), {scene: number, nodes, frames} = film.space;
  if (!prepared.has(source)) prepared.set(source, JSON.parse(source.textContent).map(scene => ({scene})));
  const stage = prepared.get(source)[number], rest = stage.scene.nodes.map(node => node.pose);
  const view = {...FIRST};
  let share = 0, asked = false;

  function posed() {
    const at = share * (frames.length - 1), whole = Math.floor(at), part = at - whole;
    const now = frames[whole], next = frames[Math.min(whole + 1, frames.length - 1)], poses = [...rest];
    nodes.forEach((node, n) => {
      const a = now.slice(7 * n, 7 * n + 7), b = next.slice(7 * n, 7 * n + 7);
      const same = a[3] * b[3] + a[4] * b[4] + a[5] * b[5] + a[6] * b[6] < 0 ? -1 : 1;
      const mixed = a.map((one, k) => one + ((k < 3 ? 1 : same) * b[k] - one) * part);
      const length = Math.hypot(...mixed.slice(3)) || 1;
      poses[node] = mixed.map((one, k) => k < 3 ? one : one / length);
    });
    return poses;
  }
  function draw() {
    asked = false;
    if (canvas.hidden || !canvas.clientWidth) return;
    const dots = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * dots), height = Math.round(canvas.clientHeight * dots);
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    stage.parts ??= space.prepared(stage.scene);
    stage.extent ??= space.extent(stage.scene);
    if (space.draw(canvas, stage.parts, posed(), {...stage.extent, ...view})) return;
    choose(false);
    button.hidden = true;
    figure.querySelector(".flat").hidden = false;
  }
  function later() { if (!asked) { asked = true; requestAnimationFrame(draw); } }
  function choose(wanted) {
    canvas.hidden = !wanted;
    above.toggleAttribute("hidden", wanted);
    button.textContent = wanted ? "from above" : "3D";
    if (wanted) later();
  }
  function turn(azimuth, elevation, away) {
    view.azimuth += azimuth;
    view.elevation = Math.min(Math.max(view.elevation + elevation, 0.05), 1.55);
    view.away = Math.min(Math.max(view.away * away, 0.1), 4);
    later();
  }

  const keys = {
    ArrowLeft: [-0.1, 0, 1], ArrowRight: [0.1, 0, 1], ArrowUp: [0, 0.1, 1], ArrowDown: [0, -0.1, 1],
    "+": [0, 0, 0.9], "-": [0, 0, 1.1]};
  canvas.addEventListener("pointerdown", event => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", event => {
    if (event.buttons & 1) turn(-event.movementX * 0.01, event.movementY * 0.01, 1);
  });
  canvas.addEventListener("wheel", event => {
    if (document.activeElement !== canvas) return;  /* the wheel scrolls the page until the picture is clicked */
    event.preventDefault();
    turn(0, 0, event.deltaY > 0 ? 1.1 : 0.9);
  }, {passive: false});
  canvas.addEventListener("keydown", event => {
    if (!(event.key in keys)) return;
    event.preventDefault();
    turn(...keys[event.key]);
  });
  canvas.addEventListener("dblclick", () => { Object.assign(view, FIRST); later(); });
  button.addEventListener("click", () => choose(canvas.hidden));
  new ResizeObserver(later).observe(canvas);
  button.hidden = false;
  choose(true);
  return now => { share = now; if (!canvas.hidden) later(); };
}

for (const figure of document.querySelectorAll("figure.replay")) {
  const film = JSON.parse(figure.querySelector("script").textContent);
  const robot = figure.querySelector(".robot"), target = figure.querySelector(".target");
  const button = figure.querySelector(".play"), slider = figure.querySelector(".at");
  const clock = figure.querySelector("output");
  const last = film.poses.length - 1, length_s = last * film.s;
  const showInSpace = inSpace(figure, film);
  let at = 0, playing = false, before = null;

  const turned = (from, to) => ((to - from + 540) % 360 + 360) % 360 - 180;

  function show() {
    const whole = Math.min(Math.floor(at), last), part = at - whole;
    const [x, y, angle] = film.poses[whole], [nx, ny, nangle] = film.poses[Math.min(whole + 1, last)];
    const place = `${(x + (nx - x) * part) / 1000} ${(y + (ny - y) * part) / 1000}`;
    robot.setAttribute("transform", `translate(${place}) rotate(${angle + turned(angle, nangle) * part})`);
    if (target) {
      let shown = film.targets[0];
      for (const one of film.targets) if (one[0] <= at) shown = one;
      target.setAttribute("transform", `translate(${shown[1] / 1000} ${shown[2] / 1000})`);
    }
    if (showInSpace) showInSpace(last ? at / last : 0);
    slider.value = whole;
    clock.textContent = `${(at * film.s).toFixed(1)} of ${length_s.toFixed(1)} s`;
  }

  function step(now) {
    if (!playing) return;
    if (before !== null) at = Math.min(at + (now - before) / 1000 / film.s, last);
    before = now;
    show();
    if (at >= last) play(false); else requestAnimationFrame(step);
  }

  function play(wanted) {
    playing = wanted;
    button.textContent = playing ? "\u23f8" : "\u25b6";
    if (!playing) return;
    if (at >= last) at = 0;
    before = null;  /* the time of a frame may be earlier than now */
    requestAnimationFrame(step);
  }

  if (last < 1) { button.disabled = slider.disabled = true; continue; }
  button.addEventListener("click", () => play(!playing));
  slider.addEventListener("input", () => { play(false); at = Number(slider.value); show(); });
}
