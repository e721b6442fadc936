// Play, pause, scrub; speed, driver, what is shown of the motion.
"use strict";

(function () {
  const { make } = Bench, $ = id => document.getElementById(id);
  const SHOWN = ["curves", "velocity", "acceleration", "centres"];

  Bench.do.play = app => app.motion && app.motion.toggle();
  for (const name of SHOWN) {
    Bench.do[name] = app => {
      app.options[name] = !app.options[name];
      app.changed("view");
    };
  }

  /** Step by a part of the whole way, from the keyboard in mode "run". */
  Bench.stepInput = (app, by) => {
    const { motion } = app, swept = motion && motion.driven && motion.sweep();
    if (!swept) { if (motion) app.say(motion.why); return; }
    motion.pause();
    const span = swept.inputs[swept.inputs.length - 1] - swept.inputs[0];
    motion.to(motion.input + (by * span) / 72);
    app.changed("rest");
  };

  function refresh(app) {
    const { motion } = app, bar = $("player");
    bar.hidden = !motion || !motion.driven || motion.stands;
    if (bar.hidden) return;
    const swept = motion.sweep(), time = $("time"), low = swept.inputs[0], high = swept.inputs[swept.inputs.length - 1];
    let value = motion.input;
    if (swept.full) value = low + ((((value - low) % (high - low)) + (high - low)) % (high - low));
    Object.assign(time, { min: low, max: high, value });
    const text = Bench.shownInput(motion, value);
    time.setAttribute("aria-valuetext", text);
    $("input").textContent = text;
  }

  function controls(app) {
    const { motion } = app;
    if (!motion) return;
    $("play").textContent = Bench.word(motion.playing ? "player.pause" : "player.play");
    $("play").setAttribute("aria-pressed", String(motion.playing));
    const { sheet } = app, choice = $("which");
    choice.replaceChildren(...sheet.drivers.map((d, k) =>
      make("option", { value: k, selected: k === motion.driver }, Bench.linkName(sheet, d.link))));
    choice.parentElement.hidden = sheet.drivers.length < 2;
  }

  /** Wire the bar under the drawing. */
  Bench.player = app => {
    const { motion } = app, time = $("time");
    $("play").addEventListener("click", () => motion.toggle());
    time.addEventListener("input", () => {
      let goal = Number(time.value); // before the pause, which puts the slider where the driver is
      motion.pause();
      const swept = motion.sweep(), span = swept.inputs[swept.inputs.length - 1] - swept.inputs[0];
      if (swept.full) goal += Math.round((motion.input - goal) / span) * span;
      motion.to(goal);
    });
    time.addEventListener("change", () => app.changed("rest"));
    $("speed").addEventListener("change", () => { motion.speed = Number($("speed").value); });
    $("which").addEventListener("change", () => { motion.driver = Number($("which").value); motion.swept = null; app.changed("rest"); });
    app.on("sheet view tool play rest", () => controls(app));
    app.on("sheet view tool play rest pose", kind => { if (kind !== "pose" || !motion.waits) refresh(app); });
    matchMedia("(prefers-reduced-motion: reduce)").addEventListener("change", event => { if (event.matches) motion.pause(); });
  };
})();
