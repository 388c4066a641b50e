"use strict";
/* Moves the robots of the replays; the page is complete without it. */
for (const figure of document.querySelectorAll("figure.replay")) {
  const film = JSON.parse(figure.querySelector("script").textContent);
  const robot = figure.querySelector(".robot"), target = figure.querySelector(".target");
  const button = figure.querySelector(".play"), slider = figure.querySelector(".at");
  const clock = figure.querySelector("output");
  const last = film.poses.length - 1, length_s = last * film.s;
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
